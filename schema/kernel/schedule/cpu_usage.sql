-- description: What ran on each CPU, second by second: all threads, also of processes without ROS.
-- grain: one row per CPU, second and thread that ran
-- when: staging.schedule
WITH extent AS (
    -- Several traces of a host may overlap: what an earlier one shows counts.
    SELECT
        c.trace_index, c.cpu, s.clock_key, s.shift_ns,
        coalesce(max(c.end_ns + s.shift_ns) OVER (
            PARTITION BY s.clock_key, c.cpu ORDER BY c.start_ns + s.shift_ns, c.trace_index
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ), c.start_ns + s.shift_ns) AS from_ns
    FROM staging.cpu_schedule AS c
    JOIN staging.schedule AS s ON c.trace_index = s.trace_index
    WHERE s.is_joined
),
run AS (
    SELECT
        e.clock_key, e.cpu,
        w.prev_tid AS tid,
        greatest(w.run_start_ns + e.shift_ns, e.from_ns) AS start_ns,
        w.ts_ns + e.shift_ns AS end_ns
    FROM raw.sched_switch AS w
    JOIN extent AS e ON w.trace_index = e.trace_index AND w.cpu_id = e.cpu
    WHERE w.run_start_ns < w.ts_ns AND w.ts_ns + e.shift_ns > e.from_ns
),
part AS (
    SELECT
        clock_key, cpu, tid, start_ns, end_ns,
        unnest(range(start_ns // 1_000_000_000, (end_ns - 1) // 1_000_000_000 + 1)) AS second
    FROM run
),
usage AS (
    SELECT
        clock_key, cpu, tid, second,
        min(start_ns) AS first_ns,
        sum(
            least(end_ns, (second + 1) * 1_000_000_000)
            - greatest(start_ns, second * 1_000_000_000)
        )::BIGINT AS running_ns
    FROM part
    GROUP BY ALL
),
named AS (
    SELECT
        s.clock_key,
        w.next_tid AS tid,
        arg_max(w.next_comm, w.event_id) AS name
    FROM raw.sched_switch AS w
    JOIN staging.schedule AS s ON w.trace_index = s.trace_index
    WHERE s.is_joined
    GROUP BY ALL
),
speed AS (
    SELECT
        clock_key, cpu, hz,
        at_ns AS start_ns,
        lead(at_ns, 1, last_ns) OVER (PARTITION BY clock_key, cpu ORDER BY at_ns) AS end_ns
    FROM (
        SELECT
            s.clock_key,
            f.of_cpu AS cpu,
            f.frequency_khz * 1000 AS hz,
            f.ts_ns + s.shift_ns AS at_ns
        FROM raw.power_cpu_frequency AS f
        JOIN staging.schedule AS s ON f.trace_index = s.trace_index
        WHERE s.is_joined
    )
    JOIN (
        SELECT
            s.clock_key,
            max(w.ts_ns + s.shift_ns) AS last_ns
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
    SELECT
        s.clock_key,
        min(t.host_id) AS host_id
    FROM staging.schedule AS s
    JOIN staging.trace AS t ON s.trace_index + 1 = t.trace_id
    WHERE s.is_joined
    GROUP BY s.clock_key
)
SELECT
    h.host_id, u.cpu,
    u.second * 1_000_000_000 AS start_ns,
    t.thread_id, u.tid, n.name, u.running_ns, f.frequency_hz
FROM usage AS u
JOIN host AS h ON u.clock_key = h.clock_key
LEFT JOIN named AS n ON u.clock_key = n.clock_key AND u.tid = n.tid
LEFT JOIN frequency AS f ON u.clock_key = f.clock_key AND u.cpu = f.cpu AND u.second = f.second
LEFT JOIN staging.thread_tid AS t ON staging.has_tid(t, u.clock_key, u.tid, u.first_ns)
ORDER BY h.host_id, u.second, u.cpu, u.tid
