"""``mapfilter serve``: a local service with a session for each device."""

from __future__ import annotations

import hashlib
import os
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mapfilter._inputs import read_input
from mapfilter._io import program_version
from mapfilter._parallel import Progress
from mapfilter._words import number_of
from mapfilter.config.sections import Config
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, Faults, InputError, fail
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.fingerprints.locating import fit_locator
from mapfilter.positioning.fingerprints.options import AUTO, LEVEL_ERROR_DB
from mapfilter.positioning.fingerprints.sources import reports_of_database
from mapfilter.radio.plan_names import PlanNames
from mapfilter.serving.app import Service
from mapfilter.serving.filters import SessionFilters
from mapfilter.serving.geolocate import Geolocator, geolocator
from mapfilter.serving.limits import ServiceLimits
from mapfilter.serving.live_page import LivePage
from mapfilter.serving.server import listen, run
from mapfilter.serving.sessions import Sessions
from mapfilter.serving.store import SessionStore
from mapfilter.viewing.bundle import database_bundle
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.outputs.terminal import print_message

TOKEN_VARIABLE = "MAPFILTER_TOKEN"

_LEAST_TOKEN, _LARGEST_TOKEN = 16, 4096


@dataclass(frozen=True)
class ServeOptions:
    """How to serve.

    Parameters
    ----------
    host, port : str and int
        Where to listen; port 0 takes a free one.
    host_names : tuple of str
        Names of this machine by which it may be asked.
    token_file : Path or None
        Its one line is the token; without it the environment variable ``MAPFILTER_TOKEN``.
    state : Path or None
        Folder of saved sessions.
    save_every_s : float
        Time between saving what is new.
    workers : int
        Threads that run steps.
    method : str or None
        Of single reports, as ``mapfilter locate`` takes it; None for "auto".
    level_error_db : float or None
        Standard deviation of predicted levels, for single reports; None for 6.
    """

    host: str = "127.0.0.1"
    port: int = 8765
    host_names: tuple[str, ...] = ()
    token_file: Path | None = None
    state: Path | None = None
    save_every_s: float = 10.0
    workers: int = 2
    method: str | None = None
    level_error_db: float | None = None
    limits: ServiceLimits = field(default_factory=ServiceLimits)

    @property
    def error_db(self) -> float:
        """Standard deviation of predicted levels."""
        return LEVEL_ERROR_DB if self.level_error_db is None else self.level_error_db

    def check(self) -> None:
        """Raise ConfigError with all faults of the numbers."""
        faults, limits = Faults(), self.limits
        if not 0 <= self.port <= 65_535:
            faults.add("--port", "0..65535", self.port)
        ranges = (
            ("--sessions", limits.sessions, 1, 100_000),
            ("--idle", limits.idle_s / 60, 0.01, 1e5),
            ("--memory", limits.state_bytes >> 20, 1, 1_000_000),
            ("--body", limits.body_bytes >> 10, 1, 65_536),
            ("--rate", limits.rate_per_s, 0.01, 1e6),
            ("--save-every", self.save_every_s, 0.01, 1e5),
            ("--level-error", self.error_db, 1e-3, 60),
        )
        for name, value, low, high in ranges:
            if not low <= value <= high:
                faults.add(name, f"{low:g}..{high:g}", value)
        faults.raise_if_any(ConfigError)


def run_serve(
    config: Config, database: Path, options: ServeOptions, progress: Progress | None = None
) -> None:
    """Serve until SIGINT or SIGTERM, then save and say what is kept.

    Raises
    ------
    MapfilterError
        The database cannot be read, the filter is not "bayes", an option is out of its range, the
        address cannot be taken, or ``state`` holds sessions of another database or is in use.
    """
    options.check()
    token = read_token(options.token_file)
    opened = open_database(database)
    filters = _filters(config, opened)
    positioner = filters.usual.positioner
    store, found = None, dict[str, dict[str, object]]()
    made = listen(options.host, options.port, token)
    with made, ExitStack() as held:
        if options.state is not None:
            store = SessionStore.in_folder(options.state, _binding(config, opened, positioner))
            held.enter_context(closing(store))
            found, lost = store.read_all()
            for line in lost:
                print_message(f"not restored: {line}")
        locate = _geolocator(opened, options, progress)
        positioner.warm_up([])
        names, limits = PlanNames(opened.plan), options.limits
        sessions = Sessions(filters, names, limits, store, options.workers)
        sessions.restore(found)
        host_names = frozenset(name.lower() for name in options.host_names)
        name = f"Live over {opened.path.name}"
        page = LivePage(lambda: database_bundle(name, opened, positioner))
        service = Service(sessions, locate, limits, token, host_names, page)
        host, port = made.getsockname()[:2]
        shown = f"[{host}]" if ":" in host else host
        restored = f"; {number_of(len(found), 'saved session')}" if store is not None else ""

        def ready() -> None:
            at = f"http://{shown}:{port}"
            print_message(f"serving {database} at {at}{restored}; to watch: {at}/view/")

        ended = run(
            service, made, save_every_s=options.save_every_s, ready=ready, warn=print_message
        )
    what = f"{number_of(ended.sessions, 'session')} "
    if not ended.sessions:
        what = "no session was open"
    elif store is None:
        what += "ended, as there is no --state to save them in"
    elif ended.saved:
        what += f"saved in {options.state}; start again with the same --state to go on"
    else:
        what += f"open, of which not all could be saved in {options.state}"
    print_message(f"stopped by {ended.signal_name or 'itself'}: {what}")


def read_token(path: Path | None) -> str:
    """Return the token of a file, else of the environment; an empty text for none.

    Raises
    ------
    ConfigError
        It is too short, or not one line of visible ASCII characters.
    InputError
        The file cannot be read.
    """
    where, token = f"environment, {TOKEN_VARIABLE}", os.environ.get(TOKEN_VARIABLE, "")
    if path is not None:
        where = f"--token-file, {path}"
        token = read_input(path, _LARGEST_TOKEN, "a token", InputError).decode("latin-1").strip()
    elif not token:
        return ""
    if len(token) < _LEAST_TOKEN or not all("!" <= one <= "~" for one in token):
        expected = f"one line of at least {_LEAST_TOKEN} visible ASCII characters"
        raise fail(ConfigError, where, expected, "something else", "openssl rand -hex 16")
    return token


def _filters(config: Config, database: RadioRouteDatabase) -> SessionFilters:
    chosen = filter_choice(config.filter)
    if config.filter.name != "bayes" or config.filter.smooth:
        got = "smooth" if config.filter.smooth else config.filter.name
        hint = "states of other filters cannot be saved, and nothing live can be smoothed"
        raise fail(ConfigError, "filter", "bayes, without smooth", got, hint)
    assert isinstance(chosen, BayesFilter)
    usual = chosen.over(database)

    def make(fitted: BayesFilter) -> BayesPositioner:
        # The map is shared.
        return usual if fitted == chosen else usual.with_options(fitted)

    return SessionFilters(chosen, make, database.plan)


def _binding(config: Config, database: RadioRouteDatabase, positioner: BayesPositioner) -> str:
    """Return what states depend on: the database and the filter's options, given and taken."""
    model = positioner.model
    taken = positioner.options, positioner.rules, model.motion, model.weights, model.evidence
    made_of = (
        f"{database.generation} {filter_choice(config.filter)!r} {taken!r} {program_version()}"
    )
    return hashlib.sha256(made_of.encode()).hexdigest()


def _geolocator(
    database: RadioRouteDatabase, options: ServeOptions, progress: Progress | None
) -> Geolocator | None:
    if not database.cell_ids:
        given = {"--method": options.method, "--level-error": options.level_error_db}
        faults = Faults()
        for option, value in given.items():
            if value is not None:
                faults.add(option, "nothing, as a database without cells locates no reports", value)
        faults.raise_if_any(ConfigError)
        return None
    known = reports_of_database(database, options.error_db)
    method = options.method or AUTO
    fitted = fit_locator(known, method, np.random.default_rng(0), progress=progress)
    return geolocator(fitted, database.plan)
