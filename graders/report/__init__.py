"""A result for people and machines: each module here formats `graders.result.Result` and adds nothing to it."""
