-- Where events of a simulation are missing from its traces (the views simulated_…): the only places
-- in which a judgement may be excused.

-- Events that are in a trace, and the trace's process where it has but one.
CREATE OR REPLACE TEMP TABLE truth_recorded AS
SELECT e.host, e.pid, e.tid, e.cpu, e.ts_ns, coalesce(t.pid, 0) AS trace_pid
FROM simulated_emitted AS e
ANTI JOIN simulated_unrecorded AS u
    ON e.host = u.host AND e.pid = u.pid AND e.tid = u.tid AND e.ts_ns = u.ts_ns
JOIN simulated_trace AS t ON e.host = t.host AND e.pid = coalesce(t.pid, e.pid);

-- What is missing on a CPU (`pid` is NULL: of any process), from the last event in the trace before
-- it to the first one after it; NULL if there is no such event. A process that the tracer stopped is
-- missing itself (`cpu` is NULL), likewise from event to event of its own. Two holes of a place never
-- overlap.
CREATE OR REPLACE TEMP TABLE truth_hole AS
WITH missing AS (
    SELECT u.host, u.pid, u.cpu, u.ts_ns, u.cause, coalesce(t.pid, 0) AS trace_pid
    FROM simulated_unrecorded AS u
    JOIN simulated_trace AS t ON u.host = t.host AND u.pid = coalesce(t.pid, u.pid)
),
on_cpu AS (
    SELECT
        m.host, nullif(m.trace_pid, 0) AS pid, m.cpu, b.ts_ns AS begin_ns, a.ts_ns AS end_ns,
        m.cause
    FROM (FROM missing WHERE cause IN ('loss', 'packets', 'truncation')) AS m
    ASOF LEFT JOIN truth_recorded AS b
        ON m.host = b.host AND m.trace_pid = b.trace_pid AND m.cpu = b.cpu AND m.ts_ns > b.ts_ns
    ASOF LEFT JOIN truth_recorded AS a
        ON m.host = a.host AND m.trace_pid = a.trace_pid AND m.cpu = a.cpu AND m.ts_ns < a.ts_ns
),
-- Packets are missing also where nothing was in them; a trace does not show that. Behind the last
-- one of a stream, the others tell how long.
of_packet AS (
    SELECT
        host, pid, cpu, since_ns AS begin_ns,
        CASE WHEN cause <> 'truncation' THEN end_ns END AS end_ns,
        cause
    FROM simulated_missing_packet
),
of_process AS (
    SELECT m.host, m.pid, NULL::INTEGER AS cpu, b.ts_ns AS begin_ns, a.ts_ns AS end_ns, m.cause
    FROM (FROM missing WHERE cause IN ('late start', 'pause', 'stop')) AS m
    ASOF LEFT JOIN truth_recorded AS b
        ON m.host = b.host AND m.pid = b.pid AND m.ts_ns > b.ts_ns
    ASOF LEFT JOIN truth_recorded AS a
        ON m.host = a.host AND m.pid = a.pid AND m.ts_ns < a.ts_ns
)
SELECT
    host, pid, cpu, cause,
    coalesce(begin_ns, -9223372036854775807) AS begin_ns,
    coalesce(end_ns, 9223372036854775807) AS end_ns
FROM (FROM on_cpu UNION FROM of_packet UNION FROM of_process);

-- CPUs without a whole packet in the trace: it does not show that there is more to them.
CREATE OR REPLACE TEMP TABLE truth_unseen_cpu AS
SELECT DISTINCT host, cpu
FROM truth_hole
WHERE cpu IS NOT NULL AND begin_ns = -9223372036854775807 AND end_ns = 9223372036854775807;
