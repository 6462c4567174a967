"""What a user can get wrong."""


class BadInput(Exception):  # noqa: N818 - it is not the program's error
    """An input that cannot be used. The message is one line that names the place (file, row,
    column or option), what was expected there and what was found. Commands print it and exit
    with status 2.
    """
