"""The two ways in which a grading can fail to happen."""


class UsageError(Exception):
    """The command line or one of its files is wrong; exit code 2."""


class InfrastructureError(Exception):
    """The machine failed, not the submission; exit code 3, and no points are lost."""
