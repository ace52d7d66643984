"""The command line: ``demsmith VERB INPUT... OUTPUT --option value``."""


def main(argv=None):
    """Run the command line.

    Parameters
    ----------
    argv : list of str, optional
        What follows the program's name; default: what this process was called with.

    Returns
    -------
    int
        Exit status: 0 done, 2 bad usage or input, 1 failure, 130 interrupted (143 terminated).
    """
    from demsmith.core.cli import interruption

    with interruption.listening():
        from demsmith.core.cli.running import run

        return run(argv)


def program():
    """Run as a program: one command line, then exit.

    Returns
    -------
    int
        As `main`.
    """
    import atexit
    import gc

    # What imports make stays to the end. Looking for garbage in it, every 700 objects and again on
    # exit, would be a quarter of a short run.
    gc.set_threshold(50_000)
    atexit.register(gc.freeze)
    return main()
