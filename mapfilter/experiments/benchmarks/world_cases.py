"""The cases of the foreign, the harsh and the sensors world; each has one definition.

All cases share the radio of :class:`mapfilter.simulation.worlds.radio.RadioModel`. A case of the
harsh world, or of that of faulty sensors, differs from ``levels-6`` of the foreign one in the one
respect after which it is named.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

from mapfilter.experiments.benchmarks.cases import CASES, Case
from mapfilter.simulation.worlds.faults import FAULTS
from mapfilter.simulation.worlds.handover import HandoverModel
from mapfilter.simulation.worlds.inertial import InertialModel
from mapfilter.simulation.worlds.phone import PhoneModel
from mapfilter.simulation.worlds.sensor_faults import SENSOR_FAULTS
from mapfilter.simulation.worlds.walkers import PedestrianModel

OtherWorld = Literal["foreign", "harsh", "sensors"]


@dataclass(frozen=True)
class WorldCase(Case):
    """One row of the table of a foreign world.

    Parameters
    ----------
    pedestrian : PedestrianModel
        How one walks.
    phone : PhoneModel
        What is reported.
    inertial : InertialModel
        The errors of dead reckoning; ``imu`` is not used.
    fault : str or None
        Fault of the inputs, out of :data:`mapfilter.simulation.worlds.faults.FAULTS`.
    other_city : bool
        Whether the log is of another city.
    sensor : str or None
        Fault of the phone's sensors during the walk, out of
        :data:`mapfilter.simulation.worlds.sensor_faults.SENSOR_FAULTS`.
    """

    pedestrian: PedestrianModel = field(default_factory=PedestrianModel)
    phone: PhoneModel = field(default_factory=PhoneModel)
    inertial: InertialModel = field(default_factory=InertialModel)
    fault: str | None = None
    other_city: bool = False
    sensor: str | None = None


_SHEET: Mapping[str, float] = MappingProxyType({"heading_sd_deg": 6.0})
_BIASED = InertialModel(bias_sd_deg=10.0, drift_deg_per_sqrt_s=0.2, scale_sd=0.05)

PHONE_UNIT = InertialModel(
    headings="fused",
    heading_sd_deg=8.0,
    step_range=0.15,
    step_wander=0.05,
    missed=0.03,
    gyro_sd_deg_per_min=15.0,
    gyro_walk_deg_per_min=3.0,
    gyro_noise_deg_per_sqrt_s=0.3,
    disturbed_every_m=150.0,
)
"""The unit of a phone, of which nothing is stated."""

_NO_COMPASS_S = 1e9
"""A time constant that is never over: fused headings start at the compass and integrate."""

_BUSY = HandoverModel(hysteresis_db=1.0, time_to_trigger_s=0.04, load_sd_db=4.0, ping_pong=0.3)

FOREIGN: Mapping[str, WorldCase] = MappingProxyType(
    {
        case.name: case
        for case in (
            WorldCase("levels-6", data_sheet=_SHEET),
            WorldCase(
                "levels-bias10", data_sheet=CASES["levels-bias10"].data_sheet, inertial=_BIASED
            ),
            WorldCase("cell-6", data_sheet=_SHEET, levels=False),
        )
    }
)
"""The cases of the foreign world."""

HARSH: Mapping[str, WorldCase] = MappingProxyType(
    {
        case.name: case
        for case in (
            WorldCase(
                "indoors-start", data_sheet=_SHEET, pedestrian=PedestrianModel(start="indoors")
            ),
            WorldCase(
                "outside-start", data_sheet=_SHEET, pedestrian=PedestrianModel(start="outside")
            ),
            WorldCase(
                "off-ways-30",
                data_sheet=_SHEET,
                pedestrian=PedestrianModel(off_ways=0.3, off_ways_exactly=True),
            ),
            WorldCase("phone-imu", inertial=PHONE_UNIT),
            WorldCase("phone-gyro", inertial=replace(PHONE_UNIT, fusion_s=_NO_COMPASS_S)),
            WorldCase(
                "reports-5s-2db", data_sheet=_SHEET, phone=PhoneModel(period_s=5.0, scale="2dB")
            ),
            WorldCase(
                "reports-10s-bars", data_sheet=_SHEET, phone=PhoneModel(period_s=10.0, scale="bars")
            ),
            WorldCase("reports-stale", data_sheet=_SHEET, phone=PhoneModel(stale_every_s=60.0)),
            WorldCase("handovers-busy", data_sheet=_SHEET, phone=PhoneModel(handover=_BUSY)),
            WorldCase("in-car-loss", data_sheet=_SHEET, phone=PhoneModel(carried="car")),
            *(WorldCase(name, data_sheet=_SHEET, fault=name) for name in FAULTS),
            WorldCase("other-city", data_sheet=_SHEET, other_city=True),
        )
    }
)
"""The cases of the harsh world."""

SENSORS: Mapping[str, WorldCase] = MappingProxyType(
    {name: WorldCase(name, data_sheet=_SHEET, sensor=name) for name in SENSOR_FAULTS}
)
"""The cases of faulty sensors."""

CASES_OF: Mapping[str, Mapping[str, WorldCase]] = MappingProxyType(
    {"foreign": FOREIGN, "harsh": HARSH, "sensors": SENSORS}
)
"""The cases of each world by name, in the order of the table."""
