"""Numeric options as axes: keys, values and configurations are checked."""

import pytest

from mapfilter._annotations import fits
from mapfilter.config.axes import check_axis, numeric_keys, parse_axis, vary
from mapfilter.config.load import load_config
from mapfilter.config.sections import Config, FilterSection
from mapfilter.errors import ConfigError
from mapfilter.positioning import BUILT_IN
from mapfilter.positioning.locators import filter_options
from mapfilter.workflows.inputs.filter_choice import filter_choice, option_sections
from mapfilter.workflows.simulate import simulation_settings
from mapfilter.workflows.sweeps.plan import _readings, _varied


def test_numeric_options_of_four_sections_are_axes():
    keys = numeric_keys()
    wanted = ("filter.margin_db", "imu.scale", "journeys.stop_s", "database.margin_db")
    assert set(wanted) <= set(keys)
    assert {key.partition(".")[0] for key in keys} == {"filter", "imu", "journeys", "database"}
    assert {"filter.bayes.heading_sd_deg", "filter.kalman.level_error_db"} <= set(keys)
    assert not {"filter.smooth", "filter.name", "imu.turns", "database.path"} & set(keys)


@pytest.mark.parametrize("key", numeric_keys())
def test_each_axis_changes_what_a_sweep_runs(key):
    """Journeys, inertial unit or filter of a plan are others with another value."""
    section, _, _ = key.rpartition(".")
    owners = (
        name
        for name in BUILT_IN
        if section in dict(option_sections(FilterSection(), filter_options(name)))
    )
    chosen = FilterSection(name=next(owners, "candidate"))
    config = Config().model_copy(update={"filter": chosen})
    value = config
    for part in key.split("."):
        value = getattr(value, part)
    values = (value or 0) + 1, (value or 0) / 2, (value or 0) + 0.25
    other = next(one for one in values if fits(numeric_keys()[key], one) and one != value)
    before, after = (
        (simulation_settings(one), filter_choice(one.filter))
        for one in (config, _varied(config, {key: other}))
    )
    assert before != after


@pytest.mark.parametrize(
    "key",
    [
        *("journeys.count", "journeys.seed", "database.tile_px", "filter.kalman.timing_memory_m"),
        *(f"filter.kalman.fix_lasting_{name}" for name in ("share", "m", "s")),
        *("filter.kalman.turn_drift_deg_per_sqrt_m", "filter.kalman.turn_rate_sd_deg_per_s"),
    ],
)
def test_what_a_sweep_does_not_use_is_no_axis(key):
    assert key not in numeric_keys()
    with pytest.raises(ConfigError, match="expected an option that a sweep uses"):
        check_axis(key, [1.0])


@pytest.mark.parametrize("key", numeric_keys())
def test_the_default_of_each_option_is_a_value_of_its_axis(key):
    value = Config()
    for part in key.split("."):
        value = getattr(value, part)
    if value is not None:
        assert check_axis(key, [value]) == (value,)
        assert vary(Config(), {key: value}) == Config()


@pytest.mark.parametrize(
    ("key", "values", "words"),
    [
        ("imu.sigma_tran_m", [1.0], "found 'imu.sigma_tran_m' (likely: 'imu.sigma_trans_m'"),
        ("heading_sd_deg", [1.0], "likely: 'filter.bayes.heading_sd_deg'"),
        ("imu.turns", [1.0], "expected a numeric option, found an option that is 'headings' or"),
        ("imu.scale", [0.1, 1.0], "imu.scale: expected a number >= 0 and < 1, found 1.0"),
        ("filter.threshold", [1.5], "filter.threshold: expected a whole number >= 1, found 1.5"),
        ("imu.scale", [0.1, 0.1], "expected every value once, found 0.1, 0.1"),
        ("imu.scale", [float("nan")], "expected a number >= 0 and < 1, found nan"),
        ("imu.scale", [], "expected at least one value, found none"),
    ],
)
def test_a_wrong_axis_is_refused(key, values, words):
    with pytest.raises(ConfigError) as raised:
        check_axis(key, values)
    assert words in str(raised.value)


def test_whole_numbers_stay_whole():
    assert parse_axis("filter.bayes.max_particles=1000,2e3") == (
        "filter.bayes.max_particles",
        (1000, 2000),
    )
    varied = vary(Config(), {"filter.threshold": 3.0})
    assert type(varied.filter.threshold) is int


@pytest.mark.parametrize("text", ["imu.scale", "imu.scale=", "imu.scale=a,b", "imu.scale=1,"])
def test_an_axis_of_another_form_is_refused(text):
    with pytest.raises(ConfigError, match=r"--vary: expected section\.key=number,number"):
        parse_axis(text)


def test_what_is_not_varied_stays(tmp_path):
    config = load_config(
        None,
        ["area.southwest=3,0", "area.size_m=500,500", "roads.half_width_by_class_m.steps=0"],
        out=tmp_path,
    )
    varied = vary(config, {"imu.sigma_orient_deg": 10, "filter.bayes.heading_sd_deg": 12.0})
    assert (varied.imu.sigma_orient_deg, varied.filter.bayes.heading_sd_deg) == (10.0, 12.0)
    back = vary(varied, {"imu.sigma_orient_deg": 3.0, "filter.bayes.heading_sd_deg": 15.0})
    assert back == config


def test_a_sweep_refuses_to_smooth_a_filter_that_cannot():
    settings = ["area.map=manhattan", "filter.smooth=true", "filter.name=candidate"]
    config = load_config(None, settings, out=None)
    expected = r"filter\.smooth \(--smooth\): expected bayes, .*, found candidate"
    with pytest.raises(ConfigError, match=expected):
        _readings(config)
