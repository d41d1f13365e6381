"""What the reproduction of DLR's paper takes for granted, and what the paper claims."""

ASSUMPTIONS = (
    "geometry only: the paper's ray-traced Munich is not published; satellites and stations are "
    "seen or not by rays past the houses, echoes and detours are drawn",
    "canyon: blocks of 80 m, streets 22 m (east-west) and 25 m wide, houses of 26 m; pedestrians "
    "walk in the 340 x 330 m in its middle, 0.8 to 1.6 m/s, 1.5 m high, up the gradient of a gas "
    "from one random target after another; 290 steps of 1 s",
    "nominal GPS 24 and Galileo 27 over 48.14 N 11.58 E, above 5°, at a random time of day, still "
    "during a track; only satellites in line of sight are measured",
    "pseudoranges: deviation 1.2 m / sin(elevation), new at each epoch; in the canyon echoes of "
    "3 m on the average, exponential, correlated over 10 m of the way; one clock for both systems",
    "clock: random walk of 2 m in a second, with which the filters reckon; as in the paper, no "
    "drift is estimated",
    "network: sites 1500 m apart, 19 of them, 30 m high, three sectors of 70° and 43 dBm + 14 dBi, "
    "2 GHz, all sending; turned by 17° against the streets; losses of 3GPP TR 38.901 UMa with or "
    "without line of sight past the canyon's houses, shadowing of 6 dB over 50 m, correlated by "
    "half between sites",
    "edge: the canyon's middle is where three cells meet, 866 m from their sites; near: 200 m from "
    "a site",
    "times of arrival: of each site's best sector; Cramér-Rao bound of 62 carriers of 15 kHz over "
    "40 symbols (the synchronisation channels of 100 ms) at the SINR, with 3 m at the least; a "
    "wrong peak anywhere within 3 km as probable as noise makes it at the SINR, which is often "
    "below -25 dB",
    "detours without line of sight: 15 m on the average, exponential, correlated over 5 m of the "
    "way and by half between stations",
    "filters know the SINR and the deviations, not the means: 3 m for echoes, 15 m for detours; "
    "they take all noise for normal and new at each epoch",
    "mobility: eq. 21 with a diagonal Q of 0.3 m and 0.3 m/s a second in all three directions; "
    "'discretised': white acceleration of 0.3 m/s in a second",
    "filters start within 10 m of the truth, 2 m in height; time differences alone are solved in "
    "two dimensions at the known height",
    "PF: 10 000 particles of the position, drawn anew at every reading; velocity and clock are "
    "Gaussian given a particle's path",
    "errors are those of east and north; static fixes are weighted Gauss-Newton for position and "
    "clock, none is refused for its geometry; 'all' compares on epochs with a static fix, "
    "'every_epoch' counts epochs without one as failures",
    "critical: fewer than four satellites of both systems in line of sight ('gps_critical': of "
    "GPS)",
)

CLAIMS = (
    "Fig. 7, GPS + Galileo, 90 %: static 40 m, PKF about 27 m, EKF about 9 m, close to the PF",
    "Fig. 8, two time differences at the cell edge, 90 %: PF about 40 m, EKF slightly worse; "
    "static and PKF tell nothing of use; near a base station neither EKF nor PF does",
    "Fig. 9, 90 %: about 17 m by GPS + Galileo, nearly 10 m with time differences at the cell edge "
    "above -17 dB, better than three fixed stations",
    "Fig. 10, fewer than four satellites, 90 %: GPS 30 m, with Galileo about 18 m, with time "
    "differences near a base station about 15 m, at the cell edge below 11 m",
)
"""The paper's; Figs. 7 and 9 disagree on the EKF."""
