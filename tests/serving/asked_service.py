"""A service that is asked in a test, and its epochs."""

import asyncio

from asking import ask


def answer_of(made, *args, **kwargs):
    return asyncio.run(ask(made.app(), *args, **kwargs))
