-- name: derive.unstamped_publication
-- kind: macro
-- description: Publications whose message can only be found by time: those of processes that
--     never show the stamp of a message. In other processes, a publication without a stamp has
--     lost an event.
-- grain: one row per publication on a known topic, written by a process without stamps
-- param: only_run BIGINT  Run to look at
CREATE OR REPLACE MACRO derive.unstamped_publication(only_run) AS TABLE
SELECT
    b.run_id,
    h.clock_id,
    p.topic_name,
    b.publisher_id,
    b.thread_id,
    b.publication_id,
    coalesce(b.rmw_ns, b.rcl_ns) AS written_ns,
    b.next_event_ns,
    -- While it was not seen, the thread may have gone on earlier, and published more.
    coalesce(k.resumed_ns <= b.next_event_ns, false) AS has_break
FROM store.publication AS b
JOIN derive.unstamped_process(only_run) AS u ON b.process_id = u.process_id
JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
JOIN store.process AS o ON b.process_id = o.process_id
JOIN store.host AS h ON o.host_id = h.host_id
ASOF LEFT JOIN store.thread_break AS k
    ON b.thread_id = k.thread_id AND coalesce(b.rmw_ns, b.rcl_ns) < k.resumed_ns
WHERE b.run_id = only_run
    AND coalesce(b.rmw_ns, b.rcl_ns) IS NOT NULL
    AND p.topic_name IS NOT NULL
