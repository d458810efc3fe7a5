"""`python -m escort_mj.cli` is `escort-mj`."""

from escort_mj.cli import main

main()
