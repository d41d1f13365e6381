"""What is saved of a session, and sessions that are made of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mapfilter.errors import Faults
from mapfilter.serving.filters import statement_document, statement_of
from mapfilter.serving.session import Progress, Session


def saved_value(session: Session, progress: Progress) -> dict[str, Any]:
    """Return what is saved of a session after some epochs."""
    return {
        "name": session.name,
        "seed": session.seed,
        "began_utc_s": session.began_utc_s,
        "stated": statement_document(session.stated),
        "state": progress.state,
        "rng": dict(progress.rng),
        "epochs": progress.epochs,
        "time_s": progress.time_s,
        "last": progress.last.decode(),
    }


def restored_session(session_id: str, saved: Mapping[str, Any]) -> Session:
    """Return a saved session, whose state stays on disk until it is used."""
    epochs, time_s, last = saved["epochs"], saved["time_s"], saved["last"].encode()
    session = Session(
        session_id,
        saved["name"],
        saved["seed"],
        saved["began_utc_s"],
        None,
        epochs=epochs,
        time_s=time_s,
        last=last,
        saved_epochs=epochs,
        saved_time_s=time_s,
        stated=statement_of(saved["stated"], Faults()),
    )
    if last:
        session.channel.keep(epochs, last)
    return session


def restored_progress(saved: Mapping[str, Any]) -> Progress:
    """Return the state of a saved session."""
    last = saved["last"].encode()
    return Progress(saved["state"], saved["rng"], saved["epochs"], saved["time_s"], last)
