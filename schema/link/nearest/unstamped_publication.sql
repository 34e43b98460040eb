-- description: Publications whose message can only be found by time. A message is written until the
--     thread goes on. Where that was not seen, or the thread may have gone on earlier, since it was
--     not seen meanwhile, it is so after some time.
-- grain: one row per publish() call without a stamp, on a known topic
CREATE OR REPLACE MACRO derive.unstamped_publication(only_run) AS TABLE
SELECT
    b.run_id, h.clock_id, p.topic_name, b.publisher_id, b.thread_id, b.publication_id, b.written_ns,
    b.is_without_event, o.last_seen_ns,
    coalesce(b.next_event_ns < k.resumed_ns, b.next_event_ns IS NOT NULL) AS goes_on,
    CASE
        WHEN goes_on THEN b.next_event_ns
        ELSE least(b.next_event_ns, b.written_ns + derive.clock_limit().write_ns)
    END AS closes_ns
FROM derive.unstamped_call(only_run) AS b
JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
JOIN store.process AS o ON b.process_id = o.process_id
JOIN store.host AS h ON o.host_id = h.host_id
ASOF LEFT JOIN store.thread_break AS k ON b.thread_id = k.thread_id AND b.written_ns < k.resumed_ns
WHERE p.topic_name IS NOT NULL
