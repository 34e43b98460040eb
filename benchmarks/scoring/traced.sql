-- How well processes of Python are known whose callbacks are traced: how long each callback ran, as
-- its node measured within it, and the times of executor threads by what they did.
CREATE OR REPLACE TEMP TABLE traced_duration AS
SELECT c.callback, c.kind, i.end_ns - i.start_ns - c.took_ns AS longer_ns
FROM (
    SELECT node || ' ' || n AS callback, kind, pid, tid, t0, t1 - t0 AS took_ns
    FROM truth_row
    -- Callbacks of clients run in tasks. Only a thread tells these apart: they are left out.
    WHERE k = 'callback' AND kind <> 'client'
) AS c
SEMI JOIN (FROM analysed.store.process WHERE python_version IS NOT NULL) AS t ON c.pid = t.pid
LEFT JOIN truth_time AS b ON b.kind = 'callback_instance' AND c.callback = b.id
LEFT JOIN place AS p ON b.host = p.host AND b.pid = p.pid AND b.tid = p.tid
LEFT JOIN analysed.store.callback_instance AS i
    ON p.thread_id = i.thread_id AND b.ts_ns = i.start_ns
CROSS JOIN (
    SELECT max(last_seen_ns) AS last_ns, min(first_seen_ns) AS first_ns
    FROM analysed.store.process
) AS r
WHERE c.t0 BETWEEN r.first_ns AND r.last_ns;

-- The time of each thread of an executor by what it did, without holes and as long in callbacks as
-- the callbacks themselves took: from the first time that it waits or selects to its last event. A
-- process that was there before its session looks for one when it waits.
CREATE OR REPLACE TEMP TABLE traced_thread AS
WITH begun AS (
    SELECT thread_id, min(start_ns) AS begin_ns
    FROM analysed.main.executor_activity
    WHERE activity NOT IN ('take', 'callback', 'service')
    GROUP BY thread_id
),
spent AS (
    SELECT
        thread_id, min(start_ns) AS start_ns, max(end_ns) AS end_ns,
        sum(end_ns - start_ns) AS known_ns,
        coalesce(sum(end_ns - start_ns) FILTER (activity IN ('callback', 'service')), 0)
            AS callback_ns
    FROM analysed.main.executor_activity
    JOIN begun USING (thread_id)
    WHERE end_ns IS NOT NULL AND start_ns >= begin_ns
    GROUP BY thread_id
),
run AS (
    SELECT thread_id, sum(end_ns - start_ns) AS callback_ns
    FROM analysed.store.callback_instance
    JOIN begun USING (thread_id)
    WHERE depth = 1 AND start_ns >= begin_ns
    GROUP BY thread_id
)
SELECT
    s.thread_id, s.end_ns - s.start_ns - s.known_ns AS hole_ns,
    s.callback_ns - coalesce(r.callback_ns, 0) AS more_ns
FROM spent AS s
JOIN analysed.store.thread AS t ON s.thread_id = t.thread_id
JOIN analysed.store.process AS p ON t.process_id = p.process_id
LEFT JOIN run AS r ON s.thread_id = r.thread_id
WHERE p.python_version IS NOT NULL;

-- Half of the callbacks are known within 20 us: of others, the node itself was interrupted before
-- it began to measure, or behind that.
CREATE OR REPLACE TEMP TABLE traced_score AS
SELECT
    'callback_time' AS kind, count(*) AS happened,
    -- A process that was there before its session asks for one when it waits.
    count(*) FILTER (NOT is_late) AS decided,
    count(longer_ns) AS found,
    CASE
        WHEN median(longer_ns) NOT BETWEEN 0 AND 20_000 THEN count(longer_ns)
        ELSE count(*) FILTER (longer_ns < 0)
    END AS wrong,
    0 AS loss_affected, 0 AS misguessed, 0 AS repeated,
    greatest(decided - found, 0) AS missing, 0 AS doubted,
    1.0 - wrong / greatest(found, 1) AS precision, 1.0 - missing / greatest(decided, 1) AS recall,
    printf(
        'longer by %.1f us, 95 %% by %.1f us', median(longer_ns) / 1e3,
        quantile_cont(longer_ns, 0.95) / 1e3
    ) AS labels
FROM traced_duration
CROSS JOIN (
    SELECT count(*) > 0 AS is_late FROM analysed.store.finding WHERE name = 'started_late'
)
HAVING count(*) > 0
UNION ALL
SELECT
    'executor_time', count(*), count(*), count(*),
    count(*) FILTER (hole_ns <> 0 OR more_ns <> 0), 0, 0, 0, 0, 0,
    1.0 - count(*) FILTER (hole_ns <> 0 OR more_ns <> 0) / count(*), 1.0, 'threads'
FROM traced_thread
HAVING count(*) > 0;
