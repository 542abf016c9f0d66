"""How the command line ends: each error becomes a message on stderr and an exit code."""

import click

from situp_annotate.errors import EXIT_INTERRUPTED, SitupError

__all__ = ["SitupGroup"]


class SitupGroup(click.Group):
    """A group of commands whose errors are those of ``situp_annotate.errors``."""

    def invoke(self, ctx: click.Context) -> object:
        """Run a command, and turn its errors into messages and exit codes."""
        try:
            return super().invoke(ctx)
        except SitupError as error:
            message = str(error)
            # The lines of several problems stand below each other.
            separator = "\n" if "\n" in message else " "
            click.echo(f"Error:{separator}{message}", err=True)
            raise click.exceptions.Exit(error.exit_code) from error
        except KeyboardInterrupt:
            click.echo("Interrupted.", err=True)
            raise click.exceptions.Exit(EXIT_INTERRUPTED) from None

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        """Return the names in the order in which the commands were added."""
        return list(self.commands)
