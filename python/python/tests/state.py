"""State of a module that a controller must not share."""

NOTES: list[str] = []
