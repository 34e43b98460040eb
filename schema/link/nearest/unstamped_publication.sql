-- description: Publications whose message can only be found by time.
-- grain: one row per publish() call without a stamp, on a known topic
CREATE OR REPLACE MACRO derive.unstamped_publication(only_run) AS TABLE
SELECT
    b.run_id, h.clock_id, p.topic_name, b.publisher_id, b.thread_id, b.publication_id, b.written_ns,
    b.next_event_ns, b.is_without_event,
    -- Its next event is seen behind a break of its record: it may have gone on earlier, and
    -- published more.
    coalesce(k.resumed_ns <= b.next_event_ns, false) AS has_break
FROM derive.unstamped_call(only_run) AS b
JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
JOIN store.process AS o ON b.process_id = o.process_id
JOIN store.host AS h ON o.host_id = h.host_id
ASOF LEFT JOIN store.thread_break AS k ON b.thread_id = k.thread_id AND b.written_ns < k.resumed_ns
WHERE p.topic_name IS NOT NULL
