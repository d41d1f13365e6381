"""Numbers on pages of commands and files are those of the program, made of its constants."""

from math import degrees, pi

import pytest
from told_numbers import number, share, told

from mapfilter.check import datum_shift, identity_checks, level_law, lobes
from mapfilter.database import checked, floor
from mapfilter.learning import cell_evidence, likelihood, network, visits
from mapfilter.positioning import epochs, known_start, vehicle_signs
from mapfilter.positioning.bayes import assembly, options
from mapfilter.positioning.bayes.rivals import alternative
from mapfilter.positioning.fingerprints import options as single
from mapfilter.positioning.fingerprints import planned
from mapfilter.positioning.kalman import models
from mapfilter.positioning.sensors import (
    undirected,
)
from mapfilter.serving import epoch_rows, events, limits
from mapfilter.tracks.checks import log_checks, motion_faults
from mapfilter.tracks.joining import moved
from mapfilter.tracks.pdr import (
    carried_bias,
    gyroscope,
    heading,
    height,
    mounted_clock,
    signals,
    standing_bias,
    steps,
    turns,
    vehicle_headings,
    walk,
)
from mapfilter.tracks.pdr import options as pdr_options
from mapfilter.tracks.readers.recorded import odometer_counts
from mapfilter.viewing import ground, trace
from mapfilter.workflows.replays import baseline

SERVICE, SITES = limits.ServiceLimits(), models.KalmanOptions()
BY_MAP, MAP_RULES = assembly._by_map_alone(
    assembly._particle_options(options.BayesFilter()), alternative.AlternativeRules()
)

SERVE = (
    f"one or up to {epoch_rows.MOST_EPOCHS} at a time",
    f"of up to {epoch_rows._MOST_ROWS} rows each",
    f"A start more than {number(known_start.START_REACH_M)} m",
    f"up to the last {events.KEPT_FIXES} fixes",
    f"At most {SERVICE.watched} sessions are watched",
    f"not sent within {number(SERVICE.receive_s)} s",
)

COMMANDS = (
    f"sessions ({SERVICE.sessions}), minutes after which an unused one ends "
    f"({number(SERVICE.idle_s / 60)}), memory for states ({SERVICE.state_bytes >> 20} MiB), "
    f"largest body ({SERVICE.body_bytes >> 10}), epochs and requests a second of one address "
    f"({number(SERVICE.rate_per_s)})",
    f"up to {number(identity_checks._NEAR_M / 1000)} km away",
    f"pixels of at most {number(datum_shift._WIDEST_PX_M)} m are needed",
    f"more than {number(lobes._FAR_OFF_DEG)}° off the lobe",
    f"from {number(level_law._FROM_M)} m on",
    f"more than {number(level_law._STEEPEST_DB)} dB per tenfold distance and are everywhere more "
    f"than {number(level_law._STEEP_BELOW_DB)} dB below",
    f"more than {number(level_law._STEEP_DB)} dB and {number(level_law._FAR_BELOW_DB)} dB, or "
    f"{number(-level_law._ABOVE_DB)} dB above free space",
)

FILES = (
    f"less than {motion_faults._SHORTER:g} or more than {motion_faults._LONGER:g} times as long",
    f"faster than {number(log_checks._FASTEST_MPS)} m/s in the median",
    f"a deviation of {number(epochs.FIX_SD_M)} m is assumed",
    f"(−{-floor.FLOORS_DBM['UMTS']:g} dBm with UMTS cells, −{-floor.FLOORS_DBM['LTE']:g} dBm with",
    f"each {checked.BLOCK_BYTES >> 10} KiB",
)

LEARN = (
    f"in one square of {number(visits.SQUARE_M)} m are one *visit*",
    f"``n / (1 + {likelihood._AGAIN:g} (n - 1))``",
    f"within {number(visits.LARGEST_RADIUS_M)} m, or levels",
    f"steps of {cell_evidence.TURNS_DEG[0]:g}°",
    f"a probability of {network._SURE:g} or more",
    f"The priors are {share(cell_evidence.PRIOR['offset'])} for an offset (deviation "
    f"{number(likelihood.LevelNoise().fault_sd_db)} dB; of sound cells "
    f"{number(likelihood.LevelNoise().cells_sd_db)} dB",
    f"{share(cell_evidence.PRIOR['rotated'])} for a rotation",
)

IMU = (
    f"{number(gyroscope.RATE_SD_RADPS * 180 / pi)} deg/s) shows",
    f"a random walk of {degrees(gyroscope.WALK_RAD_PER_SQRT_S):.2f} deg/√s",
    f"up to {number(round(degrees(gyroscope.UNSEEN_SD_RADPS), 6))} deg/s are stated for it",
    f"to {number(signals.RATE_HZ)} Hz by means",
    f"an accelerometer with {number(signals._SLOWEST_HZ)} Hz and more",
    f"a gap of the sensors of more than {signals._LONGEST_GAP_S:g} s",
    f"between {steps.BAND_HZ[0]:g} and {steps.BAND_HZ[1]:g} Hz, of {steps._PROMINENCE_MPS2:g} m/s² "
    f"and of {steps._LEAST_SHARE:g} of its neighbours",
    f"Its length is {pdr_options.STEP_FACTOR:g} times",
    f"whose size is {share(heading._SIZE_SHARE)}, or whose dip is "
    f"{number(round(degrees(heading._DIP_RAD), 6))}° off",
    f"more than {number(walk._DRIVING_MPS)} m/s, jolts are no steps",
    f"at most {height.TREAD_M:g} m long",
    f"over {carried_bias._LAG_S} s gravity",
)

ODOMETRY = (
    f"from {standing_bias._SETTLING_S:g} s after the wheels stop",
    f"({number(moved._LEAST_GAP_S)} s, and five usual intervals), or its yaw rate for more than "
    f"{number(turns.LONGEST_S)} s",
    f"one of {number(vehicle_headings._LASTING_DEG)} degrees that lasts",
    f"counts of more than {number(odometer_counts._COARSE_M)} m",
    f"({number(mounted_clock._WITHIN_S)} at most)",
    f"than {undirected.APART_SD:g} of their deviations, {number(undirected.APART_M)} m at most",
    f"a floor of {standing_bias._UNSEEN_BIAS_DEG_PER_S:g}°/s",
    f"at more than {number(vehicle_signs._PERSON_MPS)} m/s for a tenth of the time",
    f"by more than {degrees(vehicle_signs._STEADY_RADPS):.1f} deg/s from one half second",
    f"at no more than {number(vehicle_signs._MOTOR_MPS)} m/s and with at most two gains of "
    f"{number(vehicle_signs._GAIN_MPS)} m/s in {number(vehicle_signs._GAIN_S)} s",
    f"below {MAP_RULES.converge_log_odds:g} for {number(BY_MAP.switch_hold_m)} m",
)

SINGLE = (
    f"The weighted mean place of the {single.Neighbours().k} reports",
    f"exponent {single.Neighbours().exponent:g})",
    f"at most {baseline.MOST_REPORTS} reports are located",
    f"and {baseline.CALIBRATED_WITH} calibrate the regions",
    f"adds {number(planned.OWN_DB['eirp_dbm'])} dB to the error of each cell and "
    f"{number(planned.COMMON_DB['eirp_dbm'])} dB to that of all, an assumed height "
    f"{number(planned.OWN_DB['height_m'])} and {number(planned.COMMON_DB['height_m'])} dB, an "
    f"unknown azimuth {number(planned.OWN_DB['azimuth_deg'])} dB",
    f"off boresight {planned.PATTERN_SHARE:g} of the predicted attenuation",
    f"``database.floor_dbm``, unless it is set, is −{-floor.FLOORS_DBM['LTE']:g} dBm",
    f"By default {SITES.fix_lasting_share:g} of each fix's own variance lasts for "
    f"{number(SITES.fix_lasting_s)} s",
)

REPLAYS = (
    f"squares of {trace._STEPS_M[0]:g} m where it has converged, up to {trace._STEPS_M[-1]:g} m",
    f"at most {number(trace.MOST_FRAMES)} and {number(trace.MOST_EXPLAINED)} are kept",
    f"in steps of {ground.LEVEL_DB:g} dB",
)

PAGES = {
    "cli": COMMANDS,
    "file-formats": FILES,
    "howto/odometry": ODOMETRY,
    "howto/raw-imu": IMU,
    "howto/see-a-replay": REPLAYS,
    "howto/serve": SERVE,
    "howto/single-reports": SINGLE,
    "tutorial/learn": LEARN,
}


@pytest.mark.parametrize("page", PAGES)
def test_a_page_on_commands_and_files_states_the_numbers_of_the_program(page):
    text = told(page)
    missing = [some for some in PAGES[page] if some not in text]
    assert not missing
