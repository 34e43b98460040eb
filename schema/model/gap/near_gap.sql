-- description: Events with a gap between themselves and their predecessor in a sequence of their
--     thread. The sequence 'thread' has all events of a thread. `is_between`: the gap is on the CPU
--     of either event, or a pause, and so interrupts the record of the thread. Else it is on other
--     CPUs, which the thread may have visited meanwhile. `is_behind`: the event is not paired with
--     its predecessor, as the gap may hide one between them. In the sequence 'executor' any gap
--     does that, since nothing else tells that a state lasted. Elsewhere only a gap between the two
--     does: a callback that begins and ends is most likely one instance, and marked.
-- grain: one row per event and sequence
-- when: staging.gap
WITH exposed_trace AS (
    SELECT trace_index, recording_index
    FROM staging.placed_source
    WHERE recording_index IN (SELECT recording_index FROM staging.gap)
),
exposed AS (
    SELECT
        e.event_id, e.thread_index, e.trace_index, e.sequence, e.ts_ns, e.cpu_id,
        p.ts_ns AS previous_ns,
        p.cpu_id AS previous_cpu_id
    FROM staging.predecessor AS e
    JOIN staging.event AS p ON e.previous_event_id = p.event_id
    WHERE e.trace_index IN (SELECT trace_index FROM exposed_trace)
    UNION ALL
    SELECT
        event_id, thread_index, trace_index, 'thread', ts_ns, cpu_id,
        lag(ts_ns) OVER on_thread,
        lag(cpu_id) OVER on_thread
    FROM staging.event
    WHERE trace_index IN (SELECT trace_index FROM exposed_trace)
    WINDOW on_thread AS (PARTITION BY thread_index ORDER BY event_id)
),
-- Few events are near a gap, and to order all of them would take longer than all else. So time is
-- cut into stretches: a gap between two events is in the stretch of one of them, or in one between.
-- The length of a stretch decides nothing else; 100,000 at most have gaps, and two more per gap.
stretch AS (
    SELECT greatest(20_000_000, sum(end_ns - start_ns) // 100_000)::BIGINT AS length_ns
    FROM staging.gap
),
gap_stretch AS (
    SELECT DISTINCT
        g.recording_index,
        -- In damaged traces, a gap may end before it starts.
        unnest(
            range(g.start_ns // s.length_ns, greatest(g.start_ns, g.end_ns) // s.length_ns + 1)
        ) AS number
    FROM staging.gap AS g
    CROSS JOIN stretch AS s
),
candidate AS (
    SELECT x.*
    FROM (
        SELECT
            e.*, t.recording_index,
            e.ts_ns // s.length_ns AS number,
            e.previous_ns // s.length_ns AS previous_number
        FROM exposed AS e
        JOIN exposed_trace AS t ON e.trace_index = t.trace_index
        CROSS JOIN stretch AS s
    ) AS x
    WHERE x.number > x.previous_number + 1
        OR (x.recording_index, x.number) IN (FROM gap_stretch)
        OR (x.recording_index, x.previous_number) IN (FROM gap_stretch)
),
near AS (
    SELECT
        e.event_id, e.thread_index, e.sequence, e.recording_index, e.ts_ns, e.cpu_id,
        e.previous_ns, e.previous_cpu_id
    FROM candidate AS e
    ASOF JOIN staging.gap AS g ON e.recording_index = g.recording_index AND e.ts_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns OR g.any_covered_until_ns > e.previous_ns
),
place AS (
    SELECT
        event_id, sequence, recording_index, ts_ns, previous_ns,
        unnest([cpu_id, previous_cpu_id, -1]) AS cpu_id
    FROM near
),
between_the_two AS (
    SELECT DISTINCT e.event_id, e.sequence
    FROM place AS e
    ASOF JOIN staging.gap AS g
        ON e.recording_index = g.recording_index AND e.cpu_id = g.cpu_id AND e.ts_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns OR g.covered_until_ns > e.previous_ns
)
SELECT
    n.event_id, n.thread_id, n.sequence, n.ts_ns,
    b.event_id IS NOT NULL AS is_between,
    b.event_id IS NOT NULL OR n.sequence = 'executor' AS is_behind
FROM staging.located('near') AS n
LEFT JOIN between_the_two AS b ON n.event_id = b.event_id AND n.sequence = b.sequence
