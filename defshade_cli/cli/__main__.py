"""`python -m defshade_cli.cli`, for where the `defshade` script is not on the path."""

from defshade_cli.cli import process

process()
