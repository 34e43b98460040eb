-- title: A callback that waits for the disk
-- description: Its thread waits for a page or a disk most of the time that it takes.
-- grain: one row per node and callback
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    6 AS place,
    *,
    disk_ns / measured_ns AS share
FROM long_callback
WHERE disk_ns > 0.5 * measured_ns
