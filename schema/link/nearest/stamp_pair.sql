-- name: derive.stamp_pair
-- kind: macro
-- description: Messages beside publications that may be theirs. A stamp is made after the message
--     was written and before the publishing thread went on, so each pair allows an interval of
--     differences between the clock of stamps and that of the trace. If several publications
--     follow each other before the thread goes on, each has the time until the next. A publication
--     has one message: where several could be its own, only the first one counts. Else a burst
--     could as well be one publication later, if its last one takes long. Some messages per
--     stretch of time are enough, of every publisher in turn. Those of topics with one publisher
--     come first: a message of another topic may be of none of a publisher's publications.
--     A clock counts as another one once it was set (derive.clock_setting): then stamps of both
--     times do not mix.
-- grain: one row per clock, message in the sample and publication that it may be of
-- param: only_run BIGINT  Run to look at
CREATE OR REPLACE MACRO derive.stamp_pair(only_run) AS TABLE
WITH publication AS MATERIALIZED (
    FROM derive.unstamped_publication(only_run)
),
take AS MATERIALIZED (
    FROM derive.unstamped_take(only_run)
),
setting AS MATERIALIZED (
    SELECT
        row_number() OVER (ORDER BY clock_id, setting) AS setting_id,
        clock_id, setting, set_ns, since_ns, until_ns
    FROM derive.clock_setting('publication', 'take')
),
published AS MATERIALIZED (
    SELECT
        b.run_id, s.setting_id, b.clock_id, b.topic_name, b.publisher_id, b.written_ns,
        CASE
            WHEN b.next_event_ns IS NULL OR b.has_break
                THEN least(b.next_event_ns, b.written_ns + derive.clock_limit().write_ns)
            ELSE b.next_event_ns
        END AS closes_ns,
        row_number() OVER in_order AS position,
        lead(b.written_ns) OVER in_order AS next_written_ns
    FROM publication AS b
    JOIN setting AS s
        ON b.clock_id = s.clock_id AND b.written_ns >= s.since_ns AND b.written_ns < s.until_ns
    WINDOW in_order AS (PARTITION BY b.publisher_id ORDER BY b.written_ns, b.publication_id)
),
publisher AS (
    SELECT
        run_id, clock_id, topic_name, publisher_id,
        count(*) OVER (PARTITION BY topic_name) AS publisher_count
    FROM published
    GROUP BY run_id, clock_id, topic_name, publisher_id
),
message AS (
    SELECT run_id, topic_name, source_timestamp_ns, clock_id, min(taken_ns) AS taken_ns
    FROM take
    GROUP BY run_id, topic_name, source_timestamp_ns, clock_id
),
-- What the clock would have stamped, had it not been set.
heard AS MATERIALIZED (
    SELECT
        m.run_id, s.setting_id, p.clock_id, p.publisher_id, p.publisher_count,
        m.source_timestamp_ns, m.source_timestamp_ns - s.set_ns AS stamp_ns,
        m.clock_id AS taken_clock_id, m.taken_ns
    FROM message AS m
    JOIN publisher AS p ON m.run_id = p.run_id AND m.topic_name = p.topic_name
    JOIN setting AS s
        ON p.clock_id = s.clock_id
        AND m.source_timestamp_ns - s.set_ns >= s.since_ns
        AND m.source_timestamp_ns - s.set_ns < s.until_ns
),
-- A stamp that a clock showed twice is of the time that fits its way better. At least half of the
-- ways are right: those in the middle.
usual AS (
    SELECT clock_id, taken_clock_id, median(taken_ns - stamp_ns) AS way_ns
    FROM heard
    GROUP BY clock_id, taken_clock_id
),
placed AS MATERIALIZED (
    SELECT
        h.run_id, h.setting_id, h.publisher_id, h.publisher_count, h.stamp_ns,
        bool_or(h.taken_clock_id = h.clock_id) AS is_taken_here,
        coalesce(min(CASE WHEN h.taken_clock_id = h.clock_id THEN h.taken_ns END), h.stamp_ns)
            AS near_ns
    FROM heard AS h
    JOIN usual AS u ON h.clock_id = u.clock_id AND h.taken_clock_id = u.taken_clock_id
    GROUP BY
        h.run_id, h.setting_id, h.publisher_id, h.publisher_count, h.source_timestamp_ns,
        h.stamp_ns
    QUALIFY row_number() OVER (
        PARTITION BY h.publisher_id, h.source_timestamp_ns
        ORDER BY min(abs(h.taken_ns - h.stamp_ns - u.way_ns)), h.setting_id
    ) = 1
),
extent AS (
    SELECT
        p.setting_id, p.start_ns,
        1 + (p.end_ns - p.start_ns) // least(
            greatest(
                (p.end_ns - p.start_ns) // derive.clock_limit().stretch_ns,
                derive.clock_limit().least_stretches
            ),
            derive.clock_limit().most_stretches,
            greatest(m.message_count // derive.clock_limit().stretch_messages, 1)
        ) AS stretch_ns
    FROM (
        SELECT setting_id, min(written_ns) AS start_ns, max(written_ns) AS end_ns
        FROM published
        GROUP BY setting_id
    ) AS p
    JOIN (
        SELECT setting_id, count(DISTINCT stamp_ns) AS message_count
        FROM placed
        GROUP BY setting_id
    ) AS m ON p.setting_id = m.setting_id
),
turn AS (
    SELECT
        q.run_id, q.setting_id, q.publisher_id, q.publisher_count, q.stamp_ns,
        q.is_taken_here, q.near_ns, x.start_ns, x.stretch_ns,
        (q.near_ns - x.start_ns) // x.stretch_ns AS stretch,
        row_number() OVER (
            PARTITION BY
                q.setting_id, q.publisher_id, (q.near_ns - x.start_ns) // x.stretch_ns
            ORDER BY hash(q.stamp_ns), q.stamp_ns
        ) AS turn
    FROM placed AS q
    JOIN extent AS x ON q.setting_id = x.setting_id
),
sampled AS (
    SELECT
        run_id, setting_id, publisher_id, stamp_ns, is_taken_here, near_ns, start_ns, stretch_ns
    FROM turn
    QUALIFY row_number() OVER (
        PARTITION BY setting_id, stretch
        ORDER BY publisher_count, turn, stamp_ns, publisher_id
    ) <= derive.clock_limit().sampled_messages
),
-- A message may have waited in a queue while more than `reach` others were published. Clocks of one
-- machine are close, so its publication is then among those around its stamp.
wanted AS (
    SELECT
        l.run_id, l.setting_id, l.publisher_id, l.stamp_ns, l.is_taken_here, l.start_ns,
        l.stretch_ns, coalesce(p.position, l.latest_position) AS latest_position,
        unnest(
            CASE
                WHEN l.is_taken_here THEN
                    range(
                        p.position - derive.clock_limit().reach,
                        least(
                            p.position + derive.clock_limit().reach + 1,
                            l.latest_position - derive.clock_limit().reach
                        )
                    )
                    || range(
                        l.latest_position - derive.clock_limit().reach, l.latest_position + 1
                    )
                ELSE range(
                    l.latest_position - derive.clock_limit().reach,
                    l.latest_position + derive.clock_limit().reach + 1
                )
            END
        ) AS position
    FROM (
        SELECT
            s.run_id, s.setting_id, s.publisher_id, s.stamp_ns, s.is_taken_here,
            s.start_ns, s.stretch_ns, p.position AS latest_position
        FROM sampled AS s
        ASOF JOIN published AS p ON s.publisher_id = p.publisher_id AND s.near_ns >= p.written_ns
    ) AS l
    ASOF LEFT JOIN published AS p
        ON l.publisher_id = p.publisher_id AND l.stamp_ns >= p.written_ns
),
paired AS (
    SELECT
        w.run_id, w.setting_id, w.publisher_id, w.start_ns, w.stretch_ns, w.is_taken_here,
        w.position = w.latest_position AS is_latest,
        p.written_ns,
        (p.written_ns - w.start_ns) // w.stretch_ns AS stretch,
        w.stamp_ns - p.written_ns AS greatest_ns,
        w.stamp_ns - p.closes_ns AS least_ns,
        w.stamp_ns - p.next_written_ns AS later_ns,
        lag(w.stamp_ns) OVER (
            PARTITION BY w.publisher_id, w.position ORDER BY w.stamp_ns
        ) - p.written_ns AS earlier_ns
    FROM wanted AS w
    JOIN published AS p
        ON w.publisher_id = p.publisher_id
        AND w.position = p.position
        AND w.setting_id = p.setting_id
)
SELECT
    q.run_id,
    q.setting_id AS clock_id,
    s.clock_id AS trace_clock_id,
    s.set_ns,
    s.setting > 0 AS is_set,
    q.publisher_id,
    q.start_ns,
    q.stretch_ns,
    q.stretch,
    q.written_ns,
    q.written_ns - q.start_ns - q.stretch * q.stretch_ns - q.stretch_ns // 2 AS beyond_middle_ns,
    q.is_taken_here,
    q.is_latest,
    greatest(q.least_ns, q.later_ns, q.earlier_ns) AS least_ns,
    q.greatest_ns
FROM paired AS q
JOIN setting AS s ON q.setting_id = s.setting_id
WHERE coalesce(q.later_ns < q.greatest_ns, true)
