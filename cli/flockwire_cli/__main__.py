"""`python -m flockwire_cli` is the `flockwire` command."""

from flockwire_cli.entry import main

main()
