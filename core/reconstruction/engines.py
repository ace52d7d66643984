"""The engines that fill voids, by the name of the method.

An engine is a module with ``learn``, ``estimate``, ``margin`` and ``SOURCE_OF_METHOD``, as
`demsmith.core.voids.accurate` has them.
"""


def engine_of(method):
    """Give the engine of a method of `ReconstructOptions`."""
    if method == "mcmd":
        from demsmith.core.reconstruction import fast

        return fast
    from demsmith.core.voids import accurate

    return accurate
