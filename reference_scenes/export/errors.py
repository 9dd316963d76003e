"""What a scene format cannot say."""


class CannotExport(ValueError):
    """A scene that a format cannot say; the message names the field, the format's lack and what to do."""

    def __init__(self, field: str, reason: str) -> None:
        super().__init__(f"{field}: {reason}")
