-- kind: inline
-- title: What happens in a replay, in order
-- description: Events as a recording would have them: the thread looks for work (1) and executes
--     (2); the callback's message is taken (3), it begins (4), publishes (5), ends (6); its thread
--     waits (7), if it finds nothing more. Messages that no replayed callback publishes
--     have a thread of their own.
-- grain: one row per event
-- reads: replay_ran, replay_sent
-- param: outside_id BIGINT  Thread of a process outside of its executors: so much above its id
-- column: event_id BIGINT  Its place
-- column: step INTEGER  What happens
-- column: ran_id BIGINT  What ran; NULL: a message from outside
-- column: serial BIGINT  What was published, or taken; NULL: neither
-- column: thread_id BIGINT  Where
-- column: at_ns BIGINT [epoch ns]  When
SELECT
    row_number() OVER (ORDER BY at_ns, ran_id NULLS FIRST, step, serial) AS event_id,
    step, ran_id, serial, thread_id, at_ns
FROM (
    SELECT
        r.ran_id,
        unnest([1, 2, 3, 4, 6, 7]) AS step,
        unnest([NULL, NULL, r.serial, NULL, NULL, NULL]) AS serial,
        r.thread_id,
        unnest([r.looked_ns, r.start_ns, r.start_ns, r.start_ns, r.end_ns, r.free_ns]) AS at_ns,
        r.next_ns
    FROM (
        SELECT
            *,
            lead(looked_ns) OVER (PARTITION BY thread_id ORDER BY start_ns, ran_id) AS next_ns
        FROM replay_ran
    ) AS r
    UNION ALL
    SELECT
        r.ran_id, 5, s.serial,
        coalesce(r.thread_id, b.process_id + $outside_id),
        least(s.at_ns, coalesce(r.end_ns, s.at_ns)),
        NULL
    FROM replay_sent AS s
    JOIN main.publication AS b ON s.publication_id = b.publication_id
    LEFT JOIN replay_ran AS r ON s.ran_id = r.ran_id
)
WHERE (step <> 3 OR serial IS NOT NULL) AND (step <> 7 OR coalesce(next_ns > at_ns, true))
