"""What the compiler takes of numba beyond what numba promises to keep."""

from importlib.metadata import version

from escort_mj.native.compiler import numba_parts
from escort_mj.native.compiler.numba_parts import TRIED, codegen


def test_this_release_of_numba_was_tried() -> None:
    """Where this fails: run the tests of `native` with the new release, then name it in `TRIED`."""
    release = ".".join(version("numba").split(".")[:2])
    assert release in TRIED, f"numba {release} was not tried yet; these were: {', '.join(TRIED)}"


def test_what_is_not_public_is_where_it_was() -> None:
    assert callable(codegen.JITCodeLibrary._finalize_specific)
    assert callable(codegen.JITCPUCodegen._add_module) and callable(codegen.JITCPUCodegen.set_env)
    assert hasattr(codegen.JITCodeLibrary, "serialize_using_object_code")


def test_nothing_is_run_only_while_asked_for() -> None:
    before = codegen.JITCodeLibrary._finalize_specific
    with numba_parts.not_run():
        assert codegen.JITCodeLibrary._finalize_specific is not before
    assert codegen.JITCodeLibrary._finalize_specific is before
