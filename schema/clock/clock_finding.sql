-- name: derive.clock_finding
-- kind: macro
-- description: What messages and packets leave open about the clocks: those that nothing connects
--     with the others, and why, and those that do not run evenly.
-- grain: one row per pair of clocks or clock
-- needs: store.host, store.clock, derive.clock_pair
CREATE OR REPLACE MACRO derive.clock_finding(only_run) AS TABLE
WITH clock_name AS (
    SELECT clock_id, string_agg(hostname, ', ' ORDER BY host_id) AS name
    FROM store.host
    WHERE run_id = only_run
    GROUP BY clock_id
),
pair AS MATERIALIZED (
    SELECT
        p.clock_id, p.other_clock_id, c.name, o.name AS other_name, p.received_count,
        p.sent_count, p.received_packet_count, p.sent_packet_count, p.offset_ns,
        p.uncertainty_ns, p.is_even
    FROM derive.clock_pair(only_run) AS p
    JOIN clock_name AS c ON p.clock_id = c.clock_id
    JOIN clock_name AS o ON p.other_clock_id = o.clock_id
),
sync AS MATERIALIZED (
    SELECT clock_id, coalesce(reference_clock_id, clock_id) AS reference_clock_id
    FROM store.clock
    WHERE run_id = only_run
)
SELECT
    'clock_not_synchronised' AS name,
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
FROM pair AS p
JOIN sync AS c ON p.clock_id = c.clock_id
JOIN sync AS o ON p.other_clock_id = o.clock_id
WHERE c.reference_clock_id <> o.reference_clock_id
UNION ALL
SELECT
    'clock_not_synchronised',
    0,
    printf(
        'the clock of %s stays apart: no message between it and the others is known', n.name
    )
FROM clock_name AS n
WHERE n.clock_id NOT IN (SELECT clock_id FROM pair UNION ALL SELECT other_clock_id FROM pair)
    AND (SELECT count(*) FROM clock_name) > 1
UNION ALL
SELECT
    'clock_uneven',
    1,
    printf(
        'no straight line fits the clocks of %s and %s: corrected times are off by up to %.3f ms',
        p.other_name, p.name, p.uncertainty_ns / 1e6
    )
FROM pair AS p
WHERE NOT p.is_even
