"""`python -m msgflow`."""

from msgflow.cli.app import main

main()
