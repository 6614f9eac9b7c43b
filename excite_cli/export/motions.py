"""All motion formats by the name on the command line."""

from excite_cli.export.motion_csv import CsvExporter
from excite_cli.export.motion_exporter import MotionExporter
from excite_cli.export.motion_moveit import MoveitExporter
from excite_cli.export.motion_npz import NpzExporter
from excite_cli.export.motion_ros2 import Ros2Exporter
from excite_cli.export.motion_rosbag2 import McapExporter, Rosbag2Exporter

MOTION_EXPORTERS: dict[str, MotionExporter] = {
    exporter.name: exporter
    for exporter in (
        CsvExporter(),
        Ros2Exporter(),
        Rosbag2Exporter(),
        McapExporter(),
        MoveitExporter(),
        NpzExporter(),
    )
}
