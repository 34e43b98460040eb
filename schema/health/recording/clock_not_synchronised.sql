-- title: Clocks that messages could not bring together
-- description: The clocks of the run were to be corrected by messages, but nothing connects the
--     clock with the others, or messages go one way only.
-- cause: An offset needs messages, or network packets, in both directions.
-- cure: Give the offsets in a file: msgflow clocks apply FILE. If the hosts were synchronised while
--     recording, do nothing.
-- next: clocks
-- grain: one row per clock or pair of clocks
-- severity: warning
-- when: derive.clocks_to_synchronise
WITH sync AS MATERIALIZED (
    SELECT
        clock_id,
        coalesce(reference_clock_id, clock_id) AS reference_clock_id
    FROM store.clock
    WHERE run_id = $run_id
)
SELECT
    $run_id AS run_id,
    p.other_name || ' and ' || p.name AS subject,
    p.received_count + p.sent_count + p.received_packet_count + p.sent_packet_count AS count,
    CASE
        WHEN p.received_packet_count + p.sent_packet_count > 0 THEN printf(
            'the clocks of %s and %s stay apart: %d messages and %d network packets one way, %d '
            || 'and %d the other',
            p.other_name, p.name, p.received_count, p.received_packet_count, p.sent_count,
            p.sent_packet_count
        )
        ELSE printf(
            'the clocks of %s and %s stay apart: %d messages one way, %d the other',
            p.other_name, p.name, p.received_count, p.sent_count
        )
    END
    || ', and an offset needs both' AS detail
FROM clock_compared AS p
JOIN sync AS c ON p.clock_id = c.clock_id
JOIN sync AS o ON p.other_clock_id = o.clock_id
WHERE c.reference_clock_id <> o.reference_clock_id
UNION ALL
SELECT
    $run_id,
    n.name, 0,
    printf('the clock of %s stays apart: no message between it and the others is known', n.name)
FROM clock_name AS n
WHERE n.clock_id NOT IN (
    SELECT clock_id FROM clock_compared UNION ALL SELECT other_clock_id FROM clock_compared
)
