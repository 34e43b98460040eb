-- name: derive.clock_setting
-- kind: macro
-- description: When the clock that stamps messages was set, and by how much. The messages of one
--     publisher that one subscription took show it, since they are taken in the order in which
--     they were published. If stamps go back, and all that follow seem to be longer on their way,
--     the clock was set back. It was set forward if messages that were about equally long on their
--     way are followed by one that seems to be much less long on its way, and less than any before,
--     or any since stamps went back.
-- grain: one row per clock and time in which it was not set
-- param: publications VARCHAR  Name of rows of clock_id, topic_name, publisher_id
-- param: takes VARCHAR  Name of rows as of derive.unstamped_take
CREATE OR REPLACE MACRO derive.clock_setting(publications, takes) AS TABLE
WITH publisher AS MATERIALIZED (
    SELECT clock_id, topic_name, publisher_id, count(*) AS publication_count
    FROM query_table(publications)
    GROUP BY clock_id, topic_name, publisher_id
),
alone AS (
    SELECT
        topic_name,
        any_value(clock_id) AS clock_id,
        any_value(publication_count) AS publication_count
    FROM publisher
    GROUP BY topic_name
    HAVING count(*) = 1
),
-- A subscription that took many more messages than were published took those of strangers, and
-- stamps of two clocks mix.
heard AS (
    SELECT
        clock_id, source_timestamp_ns, taken_ns - source_timestamp_ns AS way_ns,
        row_number() OVER in_order AS place,
        source_timestamp_ns - lag(source_timestamp_ns) OVER in_order AS later_ns
    FROM (
        SELECT
            a.clock_id, a.publication_count, t.subscription_id, t.take_id, t.source_timestamp_ns,
            t.taken_ns,
            count(*) OVER (PARTITION BY t.subscription_id) AS take_count
        FROM query_table(takes) AS t
        JOIN alone AS a ON t.topic_name = a.topic_name
    )
    WHERE take_count < publication_count + derive.clock_limit().quorum
    WINDOW in_order AS (PARTITION BY subscription_id ORDER BY taken_ns, take_id)
    QUALIFY rank() OVER (PARTITION BY clock_id ORDER BY take_count DESC, subscription_id) = 1
),
-- Once the clock was set back, all ways may be longer than before.
witness AS MATERIALIZED (
    SELECT
        *,
        min(way_ns) OVER (
            PARTITION BY clock_id, back_count ORDER BY place
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) AS least_ns
    FROM (
        SELECT
            *,
            sum(CASE WHEN later_ns < -derive.clock_limit().write_ns THEN 1 ELSE 0 END) OVER (
                PARTITION BY clock_id ORDER BY place ROWS UNBOUNDED PRECEDING
            ) AS back_count
        FROM heard
    )
),
-- The least time on the way before and behind: few messages in a row wait.
turn AS (
    SELECT
        t.clock_id, t.place, t.source_timestamp_ns, t.way_ns, t.later_ns, t.least_ns,
        min(CASE WHEN w.place < t.place THEN w.way_ns END)
        - min(CASE WHEN w.place >= t.place THEN w.way_ns END) AS set_ns,
        max(CASE WHEN w.place < t.place THEN w.way_ns END)
        - min(CASE WHEN w.place < t.place THEN w.way_ns END) AS spread_ns
    FROM witness AS t
    JOIN witness AS w
        ON t.clock_id = w.clock_id
        AND w.place >= t.place - derive.clock_limit().quorum
        AND w.place < t.place + derive.clock_limit().quorum
    WHERE t.later_ns < -derive.clock_limit().write_ns
        OR t.way_ns < t.least_ns
    GROUP BY
        t.clock_id, t.place, t.source_timestamp_ns, t.way_ns, t.later_ns, t.least_ns
    HAVING count(*) = 2 * derive.clock_limit().quorum
),
found AS (
    SELECT clock_id, place, source_timestamp_ns, later_ns, set_ns
    FROM turn
    WHERE (later_ns < -derive.clock_limit().write_ns AND set_ns < -derive.clock_limit().write_ns)
        OR (
            set_ns > derive.clock_limit().set_ns
            AND 2 * spread_ns <= set_ns
            AND 2 * (least_ns - way_ns) > set_ns
        )
),
-- It was set between two messages.
since AS (
    SELECT
        clock_id, sum_ns AS set_ns,
        source_timestamp_ns - sum_ns + (set_ns - later_ns) // 2 AS since_ns
    FROM (
        SELECT
            clock_id, source_timestamp_ns, later_ns, set_ns,
            sum(set_ns) OVER (
                PARTITION BY clock_id ORDER BY place ROWS UNBOUNDED PRECEDING
            )::BIGINT AS sum_ns
        FROM found
    )
    UNION ALL
    SELECT DISTINCT clock_id, 0, -9223372036854775807 FROM publisher
)
SELECT
    clock_id,
    row_number() OVER in_order - 1 AS setting,
    set_ns,
    since_ns,
    lead(since_ns, 1, 9223372036854775807) OVER in_order AS until_ns
FROM since
WINDOW in_order AS (PARTITION BY clock_id ORDER BY since_ns)
