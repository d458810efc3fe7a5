"""Checks a plugin for another process, see `apart`."""

import sys

from escort_mj.conformance.apart import serve

if __name__ == "__main__":
    serve(int(sys.argv[1]), sys.argv[2])
