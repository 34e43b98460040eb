-- description: Messages beside publications that may be theirs. A stamp is made after the message
--     was written and before the publishing thread went on, so each pair allows an interval of
--     differences between the clock of stamps and that of the trace. If several publications
--     follow each other before the thread goes on, each has the time until the next. A publication
--     has one message: where several could be its own, only the first one counts, whether it is in
--     the sample or not. Else a burst could as well be one publication later, if its last one
--     takes long. Messages that follow each other vote together, as one stretch of time. A message
--     that was received behind the last event of the publishing process has no vote: its
--     publication may have been behind it, too.
-- grain: one row per clock, message in the sample and publication that it may be of
CREATE OR REPLACE MACRO derive.stamp_pair(only_run) AS TABLE
WITH published AS MATERIALIZED (
    SELECT
        clock_id, topic_name, publisher_id, written_ns, closes_ns, last_seen_ns,
        row_number() OVER in_order AS position,
        lead(written_ns) OVER in_order AS next_written_ns
    FROM derive.unstamped_publication(only_run)
    WINDOW in_order AS (PARTITION BY publisher_id ORDER BY written_ns, publication_id)
),
taken AS MATERIALIZED (
    SELECT
        p.clock_id, p.publisher_id, p.last_seen_ns, m.source_timestamp_ns, m.only_subscription_id,
        m.taken_ns,
        m.clock_id AS taken_clock_id
    FROM derive.unstamped_message(only_run) AS m
    JOIN (SELECT DISTINCT clock_id, topic_name, publisher_id, last_seen_ns FROM published) AS p
        ON m.topic_name = p.topic_name
),
-- How far another clock is from this one: the least time from stamp to take, in the beginning.
apart AS (
    SELECT
        clock_id, taken_clock_id,
        min(taken_ns - source_timestamp_ns) AS apart_ns
    FROM (
        SELECT clock_id, taken_clock_id, taken_ns, source_timestamp_ns
        FROM taken
        QUALIFY row_number() OVER (PARTITION BY clock_id, taken_clock_id ORDER BY taken_ns)
            <= derive.clock_limit().stretch_messages
    )
    GROUP BY clock_id, taken_clock_id
),
heard AS (
    SELECT
        t.clock_id, t.publisher_id, t.source_timestamp_ns, t.only_subscription_id,
        min(CASE WHEN t.taken_clock_id = t.clock_id THEN t.taken_ns END) AS taken_here_ns,
        coalesce(taken_here_ns, min(t.taken_ns - a.apart_ns)) AS received_ns
    FROM taken AS t
    JOIN apart AS a ON t.clock_id = a.clock_id AND t.taken_clock_id = a.taken_clock_id
    GROUP BY
        t.clock_id, t.publisher_id, t.last_seen_ns, t.source_timestamp_ns, t.only_subscription_id
    HAVING received_ns <= t.last_seen_ns
),
message AS (
    SELECT
        clock_id, publisher_id, source_timestamp_ns, taken_here_ns, received_ns,
        lag(source_timestamp_ns) OVER (
            PARTITION BY publisher_id, only_subscription_id ORDER BY source_timestamp_ns
        ) AS earlier_timestamp_ns,
        dense_rank() OVER (PARTITION BY clock_id ORDER BY source_timestamp_ns) AS number
    FROM heard
),
counted AS (
    SELECT
        *,
        max(number) OVER (PARTITION BY clock_id) AS message_count,
        count(*) OVER (PARTITION BY clock_id) AS heard_count
    FROM message
),
numbered AS (
    SELECT
        *,
        least(
            greatest(
                message_count // derive.clock_limit().least_stretches,
                derive.clock_limit().stretch_messages // 2
            ),
            derive.clock_limit().stretch_messages
        ) AS stretch_size,
        (number - 1) // stretch_size AS stretch
    FROM counted
),
-- A clock that was set is far from that of the trace: a take tells about when.
placed AS (
    SELECT
        s.clock_id, s.publisher_id, s.stretch, s.source_timestamp_ns, s.taken_here_ns,
        s.earlier_timestamp_ns,
        unnest(range(
            p.position - derive.clock_limit().reach, p.position + derive.clock_limit().reach + 1
        )) AS position
    FROM (
        SELECT
            *,
            unnest([source_timestamp_ns, received_ns]) AS near_ns
        FROM numbered
        WHERE stretch % (1 + heard_count // (stretch_size * derive.clock_limit().most_stretches))
            = 0
    ) AS s
    ASOF JOIN published AS p ON s.publisher_id = p.publisher_id AND s.near_ns >= p.written_ns
),
paired AS (
    SELECT DISTINCT
        m.clock_id, m.stretch, m.source_timestamp_ns, p.publisher_id, p.written_ns,
        m.taken_here_ns IS NOT NULL AS is_taken_here,
        m.source_timestamp_ns - p.written_ns AS greatest_ns,
        m.source_timestamp_ns - p.closes_ns AS least_ns,
        m.source_timestamp_ns - p.next_written_ns AS later_ns,
        m.earlier_timestamp_ns - p.written_ns AS earlier_ns
    FROM placed AS m
    JOIN published AS p
        ON m.publisher_id = p.publisher_id
        AND m.position = p.position
        AND p.written_ns <= coalesce(m.taken_here_ns, p.written_ns)
)
SELECT
    clock_id, stretch, source_timestamp_ns, is_taken_here,
    greatest(least_ns, later_ns, earlier_ns) AS least_ns,
    greatest_ns
FROM paired
WHERE coalesce(later_ns < greatest_ns, true)
