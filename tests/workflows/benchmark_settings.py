"""What each setting does to the benchmark: where it is honoured, by hand.

Each entry is a setting's other value, the settings that it needs beside it, and the place where it
must arrive.
"""

from dataclasses import fields
from math import radians

from mapfilter.positioning.kalman.models import KalmanOptions

REFUSED_SECTIONS = ("prediction.survey.", "rasters.", "track.", "sweep.")
REFUSED = {
    "prediction.ground_truth.write",
    "prediction.ground_truth.seed",
    "roads.raster",
    "roads.raster_classes",
    "database.path",
    "database.cells",
    "journeys.count",
    "journeys.draws",
    "journeys.seed",
    "journeys.radio",
    "filter.smooth",
    "filter.bayes.timing_step_m",
    "filter.bayes.timing_sd_m",
    "filter.kalman.timing_step_m",
    "filter.kalman.timing_sd_m",
    "filter.kalman.timing_memory_m",
}

OF_THE_CANDIDATE = {
    "margin_db": (3.5, "margin_db"),
    "update_length_m": (17.0, "update_length_m"),
    "tracking_length_m": (9.0, "tracking_length_m"),
    "prediction": ("last_heading", "prediction"),
    "duplicates": ("list", "duplicates"),
    "threshold": (7, "threshold"),
    "at_threshold": ("stall", "at_threshold"),
    "switch_check": ("next_call", "switch_check"),
    "when_empty": ("reinitialise", "when_empty"),
}

OF_KALMAN = tuple(
    field.name for field in fields(KalmanOptions) if not field.name.startswith("timing")
)

# Name of the setting: its value, the option, and the option's value where it has another unit.
OF_BAYES = {
    "vehicle": (True, "model.weights.off_cost_per_m", 0.15),
    "step_sd_m": (0.7, "model.motion.step_sd_m"),
    "heading_sd_deg": (7.0, "model.motion.heading_sd_rad", radians(7)),
    "bias_sd_deg": (8.0, "model.motion.bias_sd_rad", radians(8)),
    "drift_deg_per_sqrt_m": (0.4, "model.motion.bias_drift_rad_per_sqrt_m", radians(0.4)),
    "scale": (0.07, "model.motion.scale_sd"),
    "map_sd_m": (5.0, "model.weights.sd_m"),
    "map_weight_per_m": (0.2, "model.weights.weight_per_m"),
    "off_cost_per_m": (0.3, "model.weights.off_cost_per_m"),
    "levels": (False, "model.evidence.use_levels"),
    "level_error_db": (8.0, "model.evidence.levels.total_db"),
    "level_correlation_m": (70.0, "model.evidence.levels.slow_m"),
    "device_error_db": (2.5, "model.evidence.levels.device_db"),
    "fault_probability": (0.07, "model.evidence.levels.fault_probability"),
    "level_weight": (0.6, "model.evidence.levels.weight"),
    "report_spacing_m": (9.0, "model.evidence.spacing_m"),
    "threads": (2, "model.threads.count"),
    "max_particles": (15000, "options.max_particles"),
    "min_search_particles": (9000, "options.min_search_particles"),
    "min_particles": (800, "options.min_particles"),
    "switch_mass": (0.9, "options.switch_mass"),
    "switch_hold_m": (11.0, "options.switch_hold_m"),
    "claim_mass": (0.97, "rules.claimed_from"),
    "satellite_sd_m": (3.0, "satellites.zenith_m"),
    "antenna_height_m": (55.0, "satellites.height_m"),
    "antenna_height_sd_m": (33.0, "satellites.height_sd_m"),
}

OF_JOURNEYS = {
    "journeys.length_m": (900.0, "journey.length_m"),
    "journeys.speed_mps": (1.1, "journey.speed_mps"),
    "journeys.report_period_s": (0.48, "reports.report_period_s"),
    "journeys.hysteresis_db": (2.0, "reports.hysteresis_db"),
    "journeys.averaging_s": (3.0, "reports.averaging_s"),
    "journeys.fading_db": (5.0, "reports.fading_db"),
    "journeys.quantise": (False, "reports.quantise"),
    "journeys.max_neighbours": (4, "reports.max_neighbours"),
    "journeys.layer_reserve_db": (6.0, "reports.layer_reserve_db"),
    "journeys.sensitivity_dbm": (-99.0, "reports.sensitivity_dbm"),
    "journeys.phone_offset_sd_db": (6.0, "reports.phone_offset_sd_db"),
    "journeys.beside": (7.0, "journey.walker.beside"),
    "journeys.change_side_m": (77.0, "journey.walker.change_side_m"),
    "journeys.stop_every_m": (222.0, "journey.walker.stop_every_m"),
    "journeys.stop_s": (33.0, "journey.walker.stop_s"),
    "roads.profile": ("driving", "journey.profile"),
    "imu.period_s": (0.5, "imu.period_s"),
    "imu.sigma_trans_m": (0.4, "imu.sigma_trans_m"),
    "imu.sigma_orient_deg": (9.0, "imu.sigma_orient_deg"),
    "imu.bias_sd_deg": (4.0, "imu.bias_sd_deg"),
    "imu.drift_deg_per_sqrt_s": (0.3, "imu.drift_deg_per_sqrt_s"),
    "imu.scale": (0.06, "imu.scale"),
    "imu.translation_noise": ("as_printed", "imu.translation_noise"),
    "imu.heading_correlation_s": (33.0, "imu.heading_correlation_s"),
    "imu.step_scale_wander": (0.07, "imu.step_scale_wander"),
    "imu.step_scale_correlation_s": (9.0, "imu.step_scale_correlation_s"),
    "imu.turns": ("headings", "imu.turns"),
    "imu.gyro_noise_deg_per_sqrt_s": (0.4, "imu.gyro_noise_deg_per_sqrt_s"),
    "imu.gyro_bias_deg_per_s": (0.02, "imu.gyro_bias_deg_per_s"),
}

_CLUTTER = {"prediction.shadowing_db": 6.0}
_LOG_DISTANCE = {"prediction.model": "log_distance"}

OF_THE_GROUND_TRUTH = {
    "level_error_db": 4.0,
    "correlation_m": 60.0,
    "site_share": 0.2,
    "eirp_error_db": 5.0,
    "azimuth_error_deg": 20.0,
    "slope_error": 0.2,
    "clutter": "shared",
    "local_share": 0.8,
    "local_correlation_m": 30.0,
    "model": "cost231_hata",
    "street_width_m": 30.0,
    "building_separation_m": 90.0,
    "roof_error": 0.5,
    "offset_db": -3.0,
}
# The plain world's model has no streets; Walfisch-Ikegami does.
GROUND_TRUTH_BESIDE = {
    "clutter": _CLUTTER,
    "street_width_m": {"prediction.ground_truth.model": "cost231_walfisch_ikegami"},
    "building_separation_m": {"prediction.ground_truth.model": "cost231_walfisch_ikegami"},
}

OF_THE_MAP = {
    "area.map": ("synthetic", {}),
    "area.southwest": ([3.01, 0.0], {}),
    "area.size_m": ([240.0, 200.0], {}),
    "area.crs": ("EPSG:32630", {}),
    "area.resolution_m": (20.0, {}),
    "area.seed": (4, {"area.map": "synthetic"}),
    "cells.sites": (2, {}),
    "cells.sectors": (2, {}),
    "cells.indoor": (2, {}),
    "cells.frequency_mhz": (900.0, {}),
    "cells.eirp_dbm": (45.0, {}),
    "cells.height_m": (45.0, {}),
    "cells.seed": (3, {"cells.sites": 2, "cells.indoor": 2}),
    "roads.half_width_m": (25.0, {}),
    "roads.cut_buildings": (False, {"roads.half_width_m": 25.0}),
    "prediction.model": ("tr38901_umi", {}),
    "prediction.line_of_sight": ("probability", {"prediction.model": "tr38901_uma"}),
    "prediction.environment": ("open", {"prediction.model": "okumura_hata"}),
    "prediction.path_loss_exponent": (4.0, _LOG_DISTANCE),
    "prediction.reference_distance_m": (10.0, _LOG_DISTANCE),
    "prediction.reference_loss_db": (70.0, _LOG_DISTANCE),
    "prediction.metropolitan": (True, {}),
    "prediction.mobile_height_m": (2.5, {"prediction.model": "okumura_hata"}),
    "prediction.street_width_m": (10.0, {}),
    "prediction.building_separation_m": (80.0, {}),
    "prediction.street_orientation_deg": (30.0, {}),
    "prediction.shadowing_db": (6.0, {}),
    "prediction.shadowing_correlation_m": (200.0, _CLUTTER),
    "prediction.site_share": (0.1, _CLUTTER),
    "prediction.seed": (9, _CLUTTER),
    "database.margin_db": (1.0, {}),
    "database.floor_dbm": (-40.0, {}),
    "database.tile_px": (16, {}),
}

READ_AS_FOR_A_BUILD = (
    "area.bbox",
    "cells.plan",
    "cells.crs",
    "cells.layout",
    "cells.reach_m",
    "cells.antennas",
    "cells.columns.",
    "buildings.",
    "roads.half_width_by_class_m",
    "roads.squares",
    "roads.cut_water",
    "roads.water_layer",
    "roads.layer",
    "roads.class_column",
    "roads.id_column",
    "roads.landuse",
    "roads.tracks.",
)
"""Of files: read by the world of a configuration, which all commands share."""

OTHERWISE = {
    "filter.name",
    "integrity.risk",
    "integrity.alert_limit_m",
    "output.dir",
    "output.pictures",
    "journeys.nlos_satellites",
    "prediction.default_roof_height_m",
    "prediction.ground_truth.default_roof_height_m",
}
"""Settings with a test of their own."""


def toml(value):
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else repr(value)
