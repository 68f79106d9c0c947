"""What can go wrong, each with a sentence that a user can act on."""


class Error(RuntimeError):
    """Any failure of this package."""


class NotFound(Error):
    """A port, a program or a system is not there."""


class Refused(Error):
    """The far side understood and says no; nothing has changed there."""


class Timeout(Error):
    """No answer, or no message, in time."""
