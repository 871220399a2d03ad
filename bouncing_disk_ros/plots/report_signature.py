"""The mark by which the files of a report know their own."""

MARK = "bouncing_disk_ros bag_report"
