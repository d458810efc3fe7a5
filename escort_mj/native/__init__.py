"""From kernels to machine code: numba, LLVM, object files, flat memory, SIMD lanes."""
