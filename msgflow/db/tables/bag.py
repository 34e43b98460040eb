"""Table of the messages of a bag that was recorded in the same run."""

from __future__ import annotations

from msgflow.db.tables.column import moment, number, reference, table, text

table(
    "bag_message",
    reference("publication_id", "The publication that it is the message of", required=True),
    text("topic_name", "Name of the topic", required=True),
    text("type_name", "Type of the message, such as sensor_msgs/msg/Image", required=True),
    moment("received_ns", "When the recorder of the bag received it, clock of ROS", required=True),
    number("size_bytes", "Size as it was sent (CDR)", unit="bytes", required=True),
    moment("stamp_ns", "header.stamp, clock of ROS; NULL: its type has no header"),
    text("frame_id", "header.frame_id; NULL: its type has no header"),
    comment="One row per message of a bag whose publication is known (msgflow bag)",
    view="Messages of a bag that was recorded in the same run: size, stamp and frame.",
)
