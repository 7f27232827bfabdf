"""`python -m tauhat`: the command line."""

from tauhat.cli.app import main

main()
