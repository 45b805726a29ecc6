"""`python -m flockwire_operator` is the `flockwire` command."""

from flockwire_operator.cli.entry import main

main()
