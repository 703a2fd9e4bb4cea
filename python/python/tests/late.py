"""State of a module that only a step imports."""

NOTES: list[str] = []
