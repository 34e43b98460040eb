-- name: derive.nearest_message
-- kind: macro
-- description: Messages matched with publications that carry no stamp. A message was stamped after
--     its publication was written, and before the publishing thread went on. Per publisher a
--     message has one publication and a publication one message, the nearest of each other. Where
--     the thread goes on late, the delays that are usual for the publisher bound the search. A
--     message with a publication of several publishers, or one of two messages that may both be of
--     one publication, has none: that would be a guess. Nor has one where the difference of the
--     clocks is not known, or explains less than half of the messages.
-- grain: one row per message that has, or might have, a publication
-- param: only_run BIGINT  Run to look at
-- needs: derive.unstamped_publication, derive.unstamped_message, store.stamp_clock
CREATE OR REPLACE MACRO derive.nearest_message(only_run) AS TABLE
WITH clock AS (
    SELECT
        clock_id, start_ns, difference_ns, drift_ppb, at_ns,
        (end_ns - start_ns) // 1000000 + 4000 AS tolerance_ns,
        row_number() OVER on_clock = 1 AS is_first,
        lag(difference_ns) OVER on_clock AS previous_ns,
        lag(message_count) OVER on_clock AS previous_count,
        lead(difference_ns) OVER on_clock AS next_ns,
        at_ns - lag(at_ns) OVER on_clock AS since_previous_ns,
        lead(at_ns) OVER on_clock - at_ns AS until_next_ns,
        message_count
    FROM store.stamp_clock
    WHERE run_id = only_run
    WINDOW on_clock AS (PARTITION BY clock_id ORDER BY at_ns)
),
course AS (
    SELECT
        clock_id,
        CASE WHEN is_first THEN -9223372036854775807 ELSE start_ns END AS start_ns,
        difference_ns, drift_ppb, at_ns, tolerance_ns, previous_ns, next_ns,
        message_count > 0 AS is_known,
        is_first,
        coalesce(previous_count > 0, true) AS was_known,
        abs(difference_ns - previous_ns) > 50000 + since_previous_ns // 5000
            AS has_jumped_before,
        abs(next_ns - difference_ns) > 50000 + until_next_ns // 5000 AS has_jumped_after
    FROM clock
),
located AS (
    SELECT
        b.run_id, b.clock_id, b.topic_name, b.publisher_id, b.publication_id, b.written_ns,
        b.next_event_ns,
        c.tolerance_ns, c.previous_ns, c.next_ns, c.has_jumped_before, c.has_jumped_after,
        c.difference_ns
        + round((b.written_ns - c.at_ns)::DOUBLE * c.drift_ppb / 1e9)::BIGINT AS difference_ns
    FROM derive.unstamped_publication(only_run) AS b
    ASOF JOIN course AS c ON b.clock_id = c.clock_id AND b.written_ns >= c.start_ns
),
-- Around a jump of the clock a publication may be on either side of it. A message that one of
-- either side could be of is ambiguous.
published AS MATERIALIZED (
    SELECT
        0 AS side, run_id, topic_name, publisher_id, publication_id, written_ns,
        tolerance_ns,
        written_ns + difference_ns - tolerance_ns AS origin_ns,
        next_event_ns + difference_ns AS until_ns
    FROM located
    UNION ALL
    SELECT
        -1, run_id, topic_name, publisher_id, publication_id, written_ns, tolerance_ns,
        written_ns + previous_ns - tolerance_ns, next_event_ns + previous_ns
    FROM located
    WHERE has_jumped_before
    UNION ALL
    SELECT
        1, run_id, topic_name, publisher_id, publication_id, written_ns, tolerance_ns,
        written_ns + next_ns - tolerance_ns, next_event_ns + next_ns
    FROM located
    WHERE has_jumped_after
),
-- Where the clocks stood in what relation: from one jump to the next.
segment AS (
    SELECT
        clock_id,
        start_ns + CASE WHEN is_first THEN 0 ELSE difference_ns END AS start_stamp_ns,
        sum(CASE WHEN has_jumped_before OR is_known <> was_known THEN 1 ELSE 0 END) OVER (
            PARTITION BY clock_id ORDER BY start_ns ROWS UNBOUNDED PRECEDING
        ) AS segment,
        is_known
    FROM course
),
publisher AS (
    SELECT DISTINCT run_id, clock_id, topic_name, publisher_id FROM located
),
message AS MATERIALIZED (
    SELECT
        m.run_id, m.topic_name, m.source_timestamp_ns, p.publisher_id,
        min(CASE WHEN m.clock_id = p.clock_id THEN m.taken_ns END) AS taken_ns
    FROM derive.unstamped_message(only_run) AS m
    JOIN publisher AS p ON m.run_id = p.run_id AND m.topic_name = p.topic_name
    GROUP BY m.run_id, m.topic_name, m.source_timestamp_ns, p.publisher_id
),
sided AS MATERIALIZED (
    SELECT m.publisher_id, m.source_timestamp_ns, m.taken_ns, p.side
    FROM message AS m
    JOIN (SELECT DISTINCT publisher_id, side FROM published) AS p
        ON m.publisher_id = p.publisher_id
),
after AS MATERIALIZED (
    SELECT
        m.publisher_id, m.source_timestamp_ns, p.publication_id, p.until_ns,
        m.source_timestamp_ns - p.origin_ns AS delay_ns,
        row_number() OVER (
            PARTITION BY p.publication_id, p.side
            ORDER BY m.source_timestamp_ns - p.origin_ns, m.source_timestamp_ns
        ) AS place
    FROM sided AS m
    ASOF JOIN published AS p
        ON m.publisher_id = p.publisher_id
        AND m.side = p.side
        AND m.source_timestamp_ns >= p.origin_ns
    WHERE m.source_timestamp_ns < coalesce(
        p.until_ns + p.tolerance_ns // 4, p.origin_ns + 1000000000
    )
        AND coalesce(p.written_ns < m.taken_ns, true)
),
-- How much of the time the publisher was writing: what lies within by chance.
share AS (
    SELECT
        publisher_id,
        sum(until_ns - origin_ns) / greatest(max(origin_ns) - min(origin_ns), 1) AS writing
    FROM published
    GROUP BY publisher_id
),
-- Delays that lie close together, or begin close to nothing, are those of the publisher itself;
-- others may be chance, where chance is not small.
usual AS (
    SELECT
        q.publisher_id,
        CASE
            WHEN s.writing <= 0.2 THEN 1000000000
            WHEN q.quantiles[3] <= 2 * q.quantiles[2] OR q.quantiles[1] <= 200000
                THEN greatest(5000000, 4 * q.quantiles[4])
            ELSE 5000000
        END AS limit_ns,
        q.quantiles[5] AS usual_ns,
        q.quantiles[3] - q.quantiles[2] AS spread_ns
    FROM (
        SELECT
            publisher_id,
            quantile_disc(delay_ns, [0.1, 0.25, 0.75, 0.9, 0.99]) AS quantiles
        FROM after
        WHERE place = 1
        GROUP BY publisher_id
    ) AS q
    JOIN share AS s ON q.publisher_id = s.publisher_id
),
plausible AS (
    SELECT
        a.publisher_id, a.source_timestamp_ns, a.publication_id, a.place,
        a.place = 2 AND a.delay_ns <= u.usual_ns AS is_rival
    FROM after AS a
    JOIN usual AS u ON a.publisher_id = u.publisher_id
    WHERE a.delay_ns <= CASE WHEN a.until_ns IS NULL THEN greatest(1000000, 2 * u.usual_ns)
        ELSE u.limit_ns END
),
rivalled AS (
    SELECT DISTINCT publication_id FROM plausible WHERE is_rival
),
first_match AS MATERIALIZED (
    SELECT p.publisher_id, p.source_timestamp_ns, p.publication_id, r.publication_id IS NOT NULL
        AS is_rivalled
    FROM plausible AS p
    LEFT JOIN rivalled AS r ON p.publication_id = r.publication_id
    WHERE p.place = 1 OR p.is_rival
),
-- The difference of the clocks contains the shortest delay of some publisher.
before AS (
    SELECT
        m.publisher_id, m.source_timestamp_ns, p.publication_id,
        p.origin_ns - m.source_timestamp_ns AS lead_ns,
        greatest(p.tolerance_ns, least((p.until_ns - p.origin_ns) // 4, u.spread_ns)) AS limit_ns
    FROM sided AS m
    ANTI JOIN first_match AS f
        ON m.publisher_id = f.publisher_id AND m.source_timestamp_ns = f.source_timestamp_ns
    ASOF JOIN published AS p
        ON m.publisher_id = p.publisher_id
        AND m.side = p.side
        AND m.source_timestamp_ns < p.origin_ns
    LEFT JOIN usual AS u ON m.publisher_id = u.publisher_id
    WHERE coalesce(p.written_ns < m.taken_ns, true)
),
second_match AS (
    SELECT b.publisher_id, b.source_timestamp_ns, b.publication_id, false AS is_rivalled
    FROM before AS b
    ANTI JOIN first_match AS f ON b.publication_id = f.publication_id
    WHERE b.lead_ns <= b.limit_ns
    QUALIFY row_number() OVER (
        PARTITION BY b.publication_id ORDER BY b.lead_ns, b.source_timestamp_ns
    ) = 1
),
matched AS (
    SELECT
        publisher_id, source_timestamp_ns, publication_id, bool_or(is_rivalled) AS is_rivalled
    FROM (
        SELECT publisher_id, source_timestamp_ns, publication_id, is_rivalled FROM first_match
        UNION ALL
        SELECT publisher_id, source_timestamp_ns, publication_id, is_rivalled FROM second_match
    )
    GROUP BY publisher_id, source_timestamp_ns, publication_id
),
placed AS (
    SELECT
        m.run_id, m.topic_name, m.source_timestamp_ns, m.publisher_id, p.clock_id,
        coalesce(g.segment, 0) AS segment, coalesce(g.is_known, true) AS is_known
    FROM message AS m
    JOIN publisher AS p ON m.publisher_id = p.publisher_id
    ASOF LEFT JOIN segment AS g
        ON p.clock_id = g.clock_id AND m.source_timestamp_ns >= g.start_stamp_ns
),
-- A difference of the clocks explains the messages; one that fits few of them is none. Topics may
-- have publishers that were not traced, but not all of them will.
explained AS (
    SELECT
        clock_id, segment, topic_name, is_known,
        count(*) AS message_count,
        sum(CASE WHEN is_matched THEN 1 ELSE 0 END) AS matched_count
    FROM (
        SELECT
            p.clock_id, p.segment, p.topic_name, p.source_timestamp_ns, p.is_known,
            bool_or(x.publication_id IS NOT NULL) AS is_matched
        FROM placed AS p
        LEFT JOIN matched AS x
            ON p.publisher_id = x.publisher_id AND p.source_timestamp_ns = x.source_timestamp_ns
        GROUP BY p.clock_id, p.segment, p.topic_name, p.source_timestamp_ns, p.is_known
    )
    GROUP BY clock_id, segment, topic_name, is_known
),
trusted AS (
    SELECT
        clock_id, segment,
        bool_and(is_known) AND (
            coalesce(max(CASE WHEN message_count >= 8 THEN matched_count / message_count END), 0)
                >= 0.5
            OR sum(matched_count) >= 0.5 * sum(message_count)
        ) AS is_trusted
    FROM explained
    GROUP BY clock_id, segment
)
SELECT
    p.run_id,
    p.topic_name,
    p.source_timestamp_ns,
    CASE
        WHEN count(x.publication_id) = 1
            AND NOT bool_or(coalesce(x.is_rivalled, false))
            AND bool_and(x.publication_id IS NULL OR t.is_trusted)
            THEN any_value(x.publication_id)
    END AS publication_id,
    count(x.publication_id) AS candidate_count
FROM placed AS p
JOIN trusted AS t ON p.clock_id = t.clock_id AND p.segment = t.segment
LEFT JOIN matched AS x
    ON p.publisher_id = x.publisher_id AND p.source_timestamp_ns = x.source_timestamp_ns
GROUP BY p.run_id, p.topic_name, p.source_timestamp_ns
HAVING count(x.publication_id) > 0 OR bool_or(NOT t.is_trusted)
