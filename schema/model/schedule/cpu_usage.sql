-- name: staging.cpu_usage
-- description: What ran on each CPU, second by second: all threads, also of processes without ROS.
-- grain: one row per CPU, second and thread that ran
-- when: staging.schedule
-- column: host_id BIGINT  Host
-- column: cpu INTEGER  CPU
-- column: start_ns BIGINT [epoch ns]  Begin of the second
-- column: thread_id BIGINT  The thread, if it is of a ROS process
-- column: tid INTEGER  Its number to the kernel; 0: idle
-- column: name VARCHAR  Its name, the latest one
-- column: running_ns BIGINT [ns]  How long it ran
-- column: frequency_hz BIGINT [Hz]  Mean frequency of the CPU in the second, as far as it is known
WITH run AS (
    SELECT
        s.clock_key, w.trace_index, w.cpu_id AS cpu, w.prev_tid AS tid,
        w.run_start_ns + s.shift_ns AS start_ns, w.ts_ns + s.shift_ns AS end_ns
    FROM raw.sched_switch AS w
    JOIN staging.schedule AS s ON w.trace_index = s.trace_index
    WHERE s.is_joined AND w.run_start_ns < w.ts_ns
),
-- Several traces of a host may overlap: what an earlier one shows counts.
extent AS (
    SELECT
        trace_index, cpu,
        coalesce(max(max(end_ns)) OVER (
            PARTITION BY clock_key, cpu ORDER BY min(start_ns), trace_index
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ), min(start_ns)) AS from_ns
    FROM run
    GROUP BY clock_key, trace_index, cpu
),
own AS (
    SELECT
        r.clock_key, r.cpu, r.tid, greatest(r.start_ns, e.from_ns) AS start_ns, r.end_ns
    FROM run AS r
    JOIN extent AS e ON r.trace_index = e.trace_index AND r.cpu = e.cpu
    WHERE r.end_ns > e.from_ns
),
part AS (
    SELECT
        clock_key, cpu, tid, start_ns, end_ns,
        unnest(range(start_ns // 1_000_000_000, (end_ns - 1) // 1_000_000_000 + 1)) AS second
    FROM own
),
usage AS (
    SELECT
        clock_key, cpu, tid, second, min(start_ns) AS first_ns,
        sum(
            least(end_ns, (second + 1) * 1_000_000_000)
            - greatest(start_ns, second * 1_000_000_000)
        )::BIGINT AS running_ns
    FROM part
    GROUP BY ALL
),
named AS (
    SELECT s.clock_key, w.next_tid AS tid, arg_max(w.next_comm, w.event_id) AS name
    FROM raw.sched_switch AS w
    JOIN staging.schedule AS s ON w.trace_index = s.trace_index
    WHERE s.is_joined
    GROUP BY ALL
),
speed AS (
    SELECT
        clock_key, cpu, hz, at_ns AS start_ns,
        lead(at_ns, 1, last_ns) OVER (PARTITION BY clock_key, cpu ORDER BY at_ns) AS end_ns
    FROM (
        SELECT
            s.clock_key, f.of_cpu AS cpu, f.frequency_khz * 1000 AS hz,
            f.ts_ns + s.shift_ns AS at_ns
        FROM raw.power_cpu_frequency AS f
        JOIN staging.schedule AS s ON f.trace_index = s.trace_index
        WHERE s.is_joined
    )
    JOIN (
        SELECT s.clock_key, max(w.ts_ns + s.shift_ns) AS last_ns
        FROM raw.sched_switch AS w
        JOIN staging.schedule AS s ON w.trace_index = s.trace_index
        WHERE s.is_joined
        GROUP BY s.clock_key
    ) USING (clock_key)
),
frequency AS (
    SELECT
        clock_key, cpu, second,
        round(sum(hz * length_ns) / sum(length_ns))::BIGINT AS frequency_hz
    FROM (
        SELECT
            clock_key, cpu, hz, second,
            least(end_ns, (second + 1) * 1_000_000_000)
            - greatest(start_ns, second * 1_000_000_000) AS length_ns
        FROM (
            SELECT
                *,
                unnest(range(start_ns // 1_000_000_000, (end_ns - 1) // 1_000_000_000 + 1))
                    AS second
            FROM speed
            WHERE end_ns > start_ns
        )
    )
    GROUP BY ALL
),
host AS (
    SELECT s.clock_key, min(t.host_id) AS host_id
    FROM staging.schedule AS s
    JOIN staging.trace AS t ON s.trace_index + 1 = t.trace_id
    WHERE s.is_joined
    GROUP BY s.clock_key
)
SELECT
    h.host_id,
    u.cpu,
    u.second * 1_000_000_000 AS start_ns,
    t.thread_id,
    u.tid,
    n.name,
    u.running_ns,
    f.frequency_hz
FROM usage AS u
JOIN host AS h ON u.clock_key = h.clock_key
LEFT JOIN named AS n ON u.clock_key = n.clock_key AND u.tid = n.tid
LEFT JOIN frequency AS f
    ON u.clock_key = f.clock_key AND u.cpu = f.cpu AND u.second = f.second
LEFT JOIN staging.thread_tid AS t
    ON u.clock_key = t.clock_key
    AND u.tid = t.tid
    AND u.first_ns >= t.from_ns
    AND u.first_ns < t.until_ns
ORDER BY h.host_id, u.second, u.cpu, u.tid
