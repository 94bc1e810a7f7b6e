"""What ArduPilot's parameters say about sensors: facts, and calibrations that are only kept."""

from .parameter import INT8, INT32
from .rows import fact, grouped, int8, int16, real

SENSORS = [
    *grouped(
        "AHRS",
        fact(INT8, "AHRS_EKF_TYPE", 3, "Estimator", values={3: "EKF3"}),
        fact(INT8, "AHRS_ORIENTATION", 0, "Board orientation", values={0: "None"}),
        real("AHRS_TRIM_X", 0, (-0.2, 0.2), "Roll of the board", "", "rad"),
        real("AHRS_TRIM_Y", 0, (-0.2, 0.2), "Pitch of the board", "", "rad"),
        real("AHRS_TRIM_Z", 0, (-0.2, 0.2), "Yaw of the board", "", "rad"),
        fact(INT8, "EK2_ENABLE", 0, "EKF2"),
        fact(INT8, "EK3_ENABLE", 1, "EKF3"),
        fact(INT8, "EK3_SRC1_POSXY", 3, "Source of horizontal position", values={3: "GPS"}),
        fact(INT8, "EK3_SRC1_POSZ", 1, "Source of height", values={1: "Baro"}),
        fact(INT8, "EK3_SRC1_VELXY", 3, "Source of horizontal velocity", values={3: "GPS"}),
        fact(INT8, "EK3_SRC1_VELZ", 3, "Source of climb rate", values={3: "GPS"}),
        fact(INT8, "EK3_SRC1_YAW", 1, "Source of heading", values={1: "Compass"}),
        fact(INT8, "GPS1_TYPE", 1, "GPS", values={1: "AUTO"}),
        fact(INT8, "GPS2_TYPE", 0, "A second GPS", values={0: "None"}),
    ),
    *grouped(
        "COMPASS",
        fact(INT8, "COMPASS_ENABLE", 1, "A compass"),
        int8("COMPASS_USE", 1, (0, 1), "The compass gives the heading"),
        fact(INT8, "COMPASS_USE2", 0, "A second compass"),
        fact(INT8, "COMPASS_USE3", 0, "A third compass"),
        fact(INT32, "COMPASS_DEV_ID", 97539, "Device id"),
        fact(INT32, "COMPASS_PRIO1_ID", 97539, "Device id of the first compass"),
        fact(INT8, "COMPASS_EXTERNAL", 1, "External"),
        fact(INT8, "COMPASS_ORIENT", 0, "Orientation"),
        int8("COMPASS_AUTODEC", 1, (0, 1), "Declination from the position"),
        real("COMPASS_DEC", 0, (-3.142, 3.142), "Declination", "", "rad"),
        int8("COMPASS_LEARN", 0, (0, 3), "Learning of offsets"),
        real("COMPASS_OFS_X", 5, (-1800, 1800), "Offset", "", "mGauss"),
        real("COMPASS_OFS_Y", 13, (-1800, 1800), "Offset", "", "mGauss"),
        real("COMPASS_OFS_Z", -18, (-1800, 1800), "Offset", "", "mGauss"),
    ),
    *grouped(
        "INS",
        fact(INT32, "INS_ACC_ID", 2753028, "Device id of the accelerometer"),
        fact(INT32, "INS_GYR_ID", 2752772, "Device id of the gyroscope"),
        int8("INS_USE", 1, (0, 1), "The sensor is used"),
        real("INS_ACCOFFS_X", 0.001, (-3.5, 3.5), "Offset", "", "m/s/s"),
        real("INS_ACCOFFS_Y", 0.001, (-3.5, 3.5), "Offset", "", "m/s/s"),
        real("INS_ACCOFFS_Z", 0.001, (-3.5, 3.5), "Offset", "", "m/s/s"),
        real("INS_ACCSCAL_X", 1.001, (0.8, 1.2), "Scale"),
        real("INS_ACCSCAL_Y", 1.001, (0.8, 1.2), "Scale"),
        real("INS_ACCSCAL_Z", 1.001, (0.8, 1.2), "Scale"),
        real("INS_GYROFFS_X", 0, (-1, 1), "Offset", "", "rad/s"),
        real("INS_GYROFFS_Y", 0, (-1, 1), "Offset", "", "rad/s"),
        real("INS_GYROFFS_Z", 0, (-1, 1), "Offset", "", "rad/s"),
        int16("INS_ACCEL_FILTER", 10, (0, 256), "Filter", "", "Hz"),
        int16("INS_GYRO_FILTER", 20, (0, 256), "Filter", "", "Hz"),
    ),
]

ABSENT = grouped(
    "NONE",
    *(
        fact(INT8, name, 0, f"No {what}", values={0: "None"})
        for name, what in {
            "ADSB_TYPE": "ADS-B receiver",
            "CAM1_TYPE": "camera",
            "CAN_P1_DRIVER": "CAN bus",
            "FLOW_TYPE": "optical flow sensor",
            "FOLL_ENABLE": "following of others",
            "GRIP_ENABLE": "gripper",
            "MNT1_TYPE": "gimbal",
            "PRX1_TYPE": "proximity sensor",
            "RNGFND1_TYPE": "rangefinder",
            "RSSI_TYPE": "radio signal strength",
            "SCR_ENABLE": "scripts",
            "TERRAIN_ENABLE": "terrain data",
        }.items()
    ),
)
