"""Numbers that pages state are those of the program: each text is made of its constants."""

from math import degrees

import numpy as np
import pytest
from told_numbers import e_to, number, share, told

from mapfilter.database import build, estimate, parts, tiles
from mapfilter.evaluation import first_fix, intervals, map_bound, radio_map, stanford
from mapfilter.models import level_errors, street_motion, way_course, way_spread
from mapfilter.models.level_memory import SLOTS, LevelMemory
from mapfilter.models.street_motion import STATES
from mapfilter.positioning import integrity
from mapfilter.positioning.bayes import assembly, carriageways, options
from mapfilter.positioning.bayes.area import area_frame, area_tiles, opened_area, tiled_area
from mapfilter.positioning.bayes.beliefs import belief_filters, first_hypotheses, path
from mapfilter.positioning.bayes.rivals import (
    alternative,
    bends,
    compared,
    hold_rules,
    mirrored,
    step_units,
)
from mapfilter.positioning.gnss import options as gnss_options
from mapfilter.positioning.gnss import state as gnss_state
from mapfilter.positioning.gnss import trail, wander
from mapfilter.positioning.kalman import alignment, disputed, fix_errors, models, redirected, turned
from mapfilter.positioning.kalman import level_errors as site_levels
from mapfilter.positioning.sensors import (
    places,
    repeats,
    rest,
    rest_levels,
    stale_radio,
    undirected,
    unheard,
)
from mapfilter.serving import limits

BAYES, RULES, MIRROR = options.BayesFilter(), alternative.AlternativeRules(), mirrored.MirrorRules()
HOLDS, PULLS, GNSS = hold_rules.HoldRules(), hold_rules.PullRules(), gnss_options.GnssOptions()
MOTION, LEVELS = street_motion.MotionErrors(), level_errors.LevelErrors()
SITES, SERVICE = models.KalmanOptions(), limits.ServiceLimits()
KNOWN = assembly._particle_options(BAYES)
BY_MAP, MAP_RULES = assembly._by_map_alone(KNOWN, RULES)
WORDS = {4: "four", 8: "eight", 10: "ten"}


FILTER = (
    f"To converge it takes {share(BAYES.switch_mass)} of the belief in one place, and from then on "
    f"a claim takes a probability of {share(BAYES.claim_mass)}",
    f"{share(MOTION.white_share)} are white",
    f"a correlation length of {number(MOTION.heading_m)} m",
    f"every {number(1 / MOTION.disturbances_per_m)} m on average at 15°",
    f"deviation of {share(MOTION.stretch_sd)} over {number(MOTION.stretch_m)} m",
    f"{share(first_hypotheses.BEYOND_AT_START)} of the first belief lie within "
    f"{number(first_hypotheses.BEYOND_M)} m around the area",
    f"slow ({number(LEVELS.slow_db)} dB over {number(BAYES.level_correlation_m)} m)",
    f"fast ({number(LEVELS.fast_db)} dB over {number(LEVELS.fast_m)} m)",
    f"the device's ({number(BAYES.device_error_db)} dB)",
    f"correlated by {LEVELS.site_share + LEVELS.common_share:g}, those of others by "
    f"{LEVELS.common_share:g}",
    f"each keeps means for up to {SLOTS} cells",
    f"({share(BAYES.fault_probability)} at first, with a memory of {number(LEVELS.fault_m)} m)",
    f"raised to the power {BAYES.level_weight:g}",
    f"{LEVELS.tracking_share:g} of this power",
    f"``CONVERGED`` is reported when {share(BAYES.switch_mass)} of the belief lies within 50 m",
    f"for {number(BAYES.switch_hold_m)} m of travel",
    f"never fall below {e_to(alternative.LEAST_LOG_ODDS)} "
    f"({e_to(RULES.least_log_odds(searching=True))} while the belief searches)",
    f"within {number(area_frame._EDGE_M)} m of its edge (in areas below "
    f"{number(area_frame._EDGE_M / area_frame._EDGE_SHARE)} m:",
    f"From odds of {e_to(RULES.start_log_odds)} on",
    f"as soon as it is ahead by {RULES.search_threshold:g}",
    f"while the alternative is ahead by {RULES.lost_threshold:g}:",
    f"right with a probability of {share(BAYES.claim_mass)}",
    f"It starts after {number(path.PATH_M)} m",
    f"due every {number(path.LEG_M)} m",
    f"{share(BY_MAP.switch_mass)} of it in one place for {number(BY_MAP.switch_hold_m)} m",
    f"less than {e_to(MAP_RULES.converge_log_odds)}",
    f"and {number(carriageways._LANE_SD_M)} m of deviation beside it",
    f"ahead of the twin's by {MIRROR.least_lead:g} nats, with "
    f"{share(max(KNOWN.switch_mass, carriageways._LEAST_MASS))} of it in one place for "
    f"{number(max(KNOWN.switch_hold_m, carriageways._LEAST_HOLD_M))} m",
    f"- {MIRROR.margin_nats:g} - {MIRROR.usual_nats_per_m:g}` nats a metre",
    f"by {MIRROR.lead_share:g} of what the twin has lost",
    f"costs {carriageways._NULL_NATS_PER_M:g} nats a metre",
    f"Steps become legs of {number(undirected.LEG_M)} m and more",
    f"a hypothesis draws {way_course._COURSES} courses",
    f"a random walk ({MOTION.bend_rad_per_sqrt_m:g} rad/√m)",
    f"between {number(degrees(way_course._LEAST_TURN_RAD))}° and "
    f"{number(degrees(way_course._MOST_TURN_RAD))}°",
    f"a leg of {number(way_course._AHEAD_M)} m and more",
    f"dropped after {number(belief_filters._ABANDONED_BY_WAYS_M / 1000)} km instead of "
    f"{number(RULES.abandon_after_m)} m",
)

FAULTS = (
    f"of {WORDS[way_spread._PLACES]} places drawn",
    f"began at once (beyond {number(rest._BRAKES_MPS2)} m/s²), with a turn of "
    f"{number(degrees(rest._CORNER_RAD))}° within some {number(rest._CORNER_S)} s",
    f"({number(rest_levels._AT_REST_DB)} dB between two blocks of {number(rest._BLOCK_S)} s, "
    f"besides {number(rest_levels._ALL_DB)} dB that all cells share), elsewhere by "
    f"{number(rest_levels._ELSEWHERE_DB)} dB",
    f"log-likelihood ratio reaches {number(rest._CARRIED_NATS)}",
    f"ten minutes adds {rest._NATS_PER_CELL:g}",
    f"({rest_levels._FADING_DB:g} dB, and {rest_levels._WHITE_DB:g} dB for each single level)",
    f"{rest_levels._WAY_DB:g}^2 (1 - e^{{-x/{rest_levels._WAY_M:g}}})",
    f"to the power {rest_levels._BLOCK_SHARE:g}, at most {rest_levels._MOST_NATS:g} a block",
    f"From {number(rest._LEFT_M)} m at that pace on",
    f"while the sum is above {rest._SHOWN_NATS:g}, and again until it is below "
    f"{rest._SHOWN_AGAIN_NATS:g}",
    f"(the sum were above {rest._SHOWABLE_NATS:g},",
    f"reach a sum that is lower by {rest._NATS_PER_FACTOR:g}",
    f"from {number(rest._NEAR_M)} m at that pace on a walker's position",
    f"times :math:`e^{{S/{rest._NATS_PER_FACTOR:g}}}`",
    f"levels show it as hardly any way does ({rest._CERTAIN_NATS:g})",
    f"as clearly as those of a minute or more do (a sum of {rest._CLEAR_NATS:g} below)",
    f"after {number(unheard._RIDE_S)} s or more, of other cells",
    f"{stale_radio._NATS_PER_M:g} for each metre and level",
    f"at most {stale_radio._NATS_PER_REPORT:g} for one level or two, "
    f"{3 * stale_radio._NATS_PER_LEVEL:.1f} for three",
    f"From {stale_radio.STALE_NATS:g} on it is ``stale_radio``",
    f"From {repeats._STILL_NATS:g} on it is ``heading_stuck``",
    f"after {repeats._NEVER_ROWS} rows and {number(repeats._NEVER_M)} m "
    f"({number(repeats._NEVER_COARSE_M)} m where",
    f"Its odds are {e_to(step_units._OTHER_UNIT_NATS)} to 1",
    f"while it is less than {number(-step_units._OPEN_NATS)} nats behind",
    f"jumps by more than {number(HOLDS.jump_deg)}° from one row of a walk to the next (of at most "
    f"{number(HOLDS.longest_row_m)} m)",
    f"of {HOLDS.particles} to {2 * HOLDS.particles} hypotheses",
    f"Where a jump is less than {number(HOLDS.around_deg)}°",
    f"more than {number(HOLDS.bend_deg)}°, and less than {number(HOLDS.around_deg)}°, from the "
    f"direction of the last metres (a mean that falls off by 1/e in "
    f"{number(bends._MEMORY_M)} m, of {number(bends._LEAST_M)} m or more)",
    f"after {number(compared._BEND_M)} m, unless something speaks for it (a Bayes factor of "
    f"{e_to(compared.SPEAKS_NATS)} or more), and at one of {e_to(compared._BEND_NATS)}.",
    f"odds that a jump is the phone's are {HOLDS.probability:g} to 1",
    f"turn it back with {WORDS[HOLDS.back_odds]} times these odds",
    f"From {e_to(HOLDS.lost_log_odds)} on (a probability of 0.27), with a position more than 50 m "
    f"away, for {number(HOLDS.lost_after_m)} m or more",
    f"From {e_to(HOLDS.win_log_odds)} on the other belief takes over",
    f"A Bayes factor of {e_to(HOLDS.abandon_threshold)}, {number(HOLDS.abandon_after_m)} m "
    f"({number(HOLDS.abandon_ahead_after_m)} m where",
    f"stands for more than {number(HOLDS.longest_pause_s)} s",
    f"by the {number(GNSS.gate + 1)} nats of its gate at most each",
    f"undecided for {number(PULLS.abandon_after_m)} m",
    f"is {number(-PULLS.search_threshold)} behind",
    f"odds of 1 to {number(1 / PULLS.probability)} for such positions",
    f"after {number(GNSS.trial_m)} m of that they are used again",
    f"count as one over {number(GNSS.fix_memory_m)} m of way; those of a vehicle over "
    f"{number(assembly._VEHICLE_FIX_MEMORY_S)} s, too",
    f"over {number(gnss_state._MEMORY_M)} m of way, by the squared distances",
    f"From {gnss_state._SHOWN:g} times on their variances count",
    f"{number(wander._APART_S)} s apart or more, eight of them",
    f"and from {wander._SHOWN:g} times on variances count",
    f"no step has been counted for {number(wander._RESTS_S)} s",
    f"positions at least {number(places._APART_S)} s apart are kept",
    f"between and {number(places._LEAST_S)} s or more apart",
    f"near each other for {number(places._STANDS_S)} s",
    f"below {rest._DRIFT_MPS:g} m/s",
    f"The last {trail._MOST_FIXES} fixes, at least {number(trail._APART_M)} m or "
    f"{number(trail._APART_S)} s apart",
    f"three or more over {number(GNSS.dispute_s)} s, {share(trail._LEAST_SHARE)} have to lie "
    f"within {trail._DEVIATIONS:g} of their standard deviations (of {number(trail._LEAST_SD_M)} m",
    f"by more than {number(degrees(trail._TURNED_RAD))}°, known to "
    f"{number(degrees(trail._MOST_SD_RAD))}°",
    f"up to {number(GNSS.agreed_trust)}. Else",
)

FUSION = (
    f"parts {number(SITES.start_spacing_m)} m apart on the circle of the first timing advance, or "
    f"{SITES.start_parts} x {SITES.start_parts} of them",
    f"({number(SITES.bias_sd_deg)}° at first, and a random walk of {SITES.drift_deg_per_sqrt_m:g}° "
    f"per √m, or {SITES.turn_drift_deg_per_sqrt_m:g}° where",
    f"are too short ({share(SITES.scale)})",
    f"One that is {number(degrees(turned._LEAST_TURN_RAD))}° or more",
    f"known within {number(degrees(turned._FOUND_RAD))}°",
    f"{SITES.fix_lasting_share:g} is a Gauss-Markov process of {number(SITES.fix_lasting_s)} s",
    f"beyond {disputed._LIMIT**0.5:.1f} deviations",
    f"where {disputed._TRUSTED} had agreed before, end for a minute after a burst of "
    f"{number(disputed._BURST_S)} s at most",
    f"more than {disputed._FAR**0.5:.1f} of their own deviations",
    f"by {number(disputed._MOVING_MPS)} m/s or more for {number(disputed._MOVING_S)} s, or by "
    f"{disputed._SLOW_MPS:g} m/s for {number(disputed._SLOW_S)} s",
    f"for two minutes and in {WORDS[fix_errors._PROVEN_FIXES]} fixes",
    f"more than {number(alignment._LEAST_M)} m and eight of their deviations apart",
    f"open again, by {number(degrees(redirected._ASTRAY_RAD))}° and "
    f"{number(degrees(redirected._ASTRAY_RADPS))} deg/s",
    f"all cells share ({number(SITES.level_offset_db)} dB, "
    f"{number(SITES.level_offset_memory_m / 1000)} km)",
    f"({number(SITES.level_error_db)} dB, {number(SITES.level_memory_m)} m)",
    f"counts once in {number(site_levels._ONCE * SITES.level_memory_m)} m",
    f"noise of {number(SITES.level_noise_db)} dB",
    f"count as one in {number(SITES.level_noise_memory_m)} m and in "
    f"{number(SITES.timing_memory_m)} m travelled",
    f"within {number(SITES.reach_m / 1000)} km of the serving cell",
)

SATELLITES = (
    f"the lead of {RULES.search_threshold:g} that an alternative needs during a search",
    f"still less the {RULES.lost_threshold:g} against a belief that had converged",
    f"by no more than {GNSS.trust:g} in all",
    f"less probable than {e_to(-GNSS.gate)} of the usual",
    f"none is used for {number(GNSS.probation_s)} s",
    f"rejected satellites for {number(GNSS.dispute_s)} s",
    f"Satellites below {number(GNSS.mask_deg)}° are left out",
    f"every {number(BAYES.report_spacing_m)} m; without reports every {number(GNSS.spacing_m)} m",
    f"abandoned after {number(RULES.abandon_after_m)} m",
)

BOUND = (
    f"a standard deviation of {number(radio_map.ErrorModel().deviation_db)} dB, correlated along "
    f"the way as exp(−d / {number(radio_map.ErrorModel().correlation_m)} m)",
    f"at most {map_bound.COMPARED} places of each cell",
    f"(one in each square of {number(first_fix.FirstFixOptions().spacing_m)} m)",
    f"when {share(first_fix.FirstFixOptions().mass)} of the weight",
    f"the first {number(first_fix.FirstFixOptions().path_m)} m, in bits",
    f"without a fix after {first_fix.FirstFixOptions().most_m:.0f} m",
    f"at least {number(first_fix.FirstFixOptions().apart_m)} m away",
    f"Pairs from {map_bound.TWIN_ERROR:g} on",
)

SCALE = (
    f"computes up to {estimate._SAMPLED_TILES} tiles",
    f"at most {number(build.PIXELS_A_TASK / 1e6)} million pixels",
    f"about {parts.ROWS_IN_MEMORY / 1e6:.1f} million levels",
    f"for up to {tiles._MAX_TILES} neighbouring tiles",
    f"{number(opened_area.WHOLE_VALUES / 1e6)} million levels (rows",
    f"tiles of {area_tiles.TILE_PX} × {area_tiles.TILE_PX} pixels",
    f"at most {area_tiles.HELD_BYTES >> 20} MiB",
    f"begins in the {tiled_area.SEARCH_TILES} tiles",
    f"more than {tiled_area.SEARCH_TILES // 2} of these",
)

CALIBRATION = (f"(percentile bootstrap, {intervals._DRAWS} draws)",)
PROTECTION = (
    f"({number(stanford.IntegrityOptions().alert_limit_m)} m unless you set",
    f"{integrity._SILVERMAN:g} *s*",
    f"T + {integrity._Z_95:.3f} √(T / n)",
)

PAGES = {
    "explanation/bayes-faults": FAULTS,
    "explanation/bayes-filter": FILTER,
    "explanation/bound": BOUND,
    "explanation/calibration": CALIBRATION,
    "explanation/fusion": FUSION,
    "explanation/protection-levels": PROTECTION,
    "explanation/satellites-on-the-map": SATELLITES,
    "explanation/scale": SCALE,
}


@pytest.mark.parametrize("page", PAGES)
def test_a_page_states_the_numbers_of_the_program(page):
    text = told(page)
    missing = [some for some in PAGES[page] if some not in text]
    assert not missing


def test_numbers_of_a_particle_and_what_is_moved_of_them_in_a_step():
    """Of the step that is measured: levels of ten cells."""
    kept = LevelMemory.empty(LEVELS, np.arange(10)).width
    text = told("explanation/speed")
    assert f"Each particle keeps {STATES + kept} numbers" in text
    assert f"keeps {STATES + kept} ({STATES} of the state, {kept} of the lasting errors" in text
    moved = 4 * 4 * (STATES + kept)
    assert f"by the copying ({moved} bytes)" in text
    assert f"about {moved} bytes a particle" in text
