-- description: Messages beside publications that may be theirs. A stamp is made after the message
--     was written and before the publishing thread went on, so each pair allows an interval of
--     differences between the clock of stamps and that of the trace. If several publications
--     follow each other before the thread goes on, each has the time until the next. A publication
--     has one message: where several could be its own, only the first one counts, whether it is in
--     the sample or not. Else a burst could as well be one publication later, if its last one
--     takes long. Some messages per stretch of time are enough, of every publisher in turn. Those
--     of topics with one publisher come first: a message of another topic may be of none of a
--     publisher's publications. A message that was taken on this clock counts in one stretch,
--     whatever publication it may be of: else chance gives a wrong difference more messages than
--     the right one.
-- grain: one row per clock, message in the sample and publication that it may be of
CREATE OR REPLACE MACRO derive.stamp_pair(only_run) AS TABLE
WITH published AS MATERIALIZED (
    SELECT
        run_id, clock_id, topic_name, publisher_id, written_ns,
        CASE
            WHEN next_event_ns IS NULL OR has_break
                THEN least(next_event_ns, written_ns + derive.clock_limit().write_ns)
            ELSE next_event_ns
        END AS closes_ns,
        row_number() OVER in_order AS position,
        lead(written_ns) OVER in_order AS next_written_ns
    FROM derive.unstamped_publication(only_run)
    WINDOW in_order AS (PARTITION BY publisher_id ORDER BY written_ns, publication_id)
),
message AS MATERIALIZED (
    SELECT run_id, topic_name, source_timestamp_ns, only_subscription_id, clock_id, taken_ns
    FROM derive.unstamped_message(only_run)
),
extent AS (
    SELECT
        run_id, clock_id, start_ns, end_ns,
        1 + (end_ns - start_ns) // least(
            greatest(
                (end_ns - start_ns) // derive.clock_limit().stretch_ns,
                derive.clock_limit().least_stretches
            ),
            derive.clock_limit().most_stretches,
            greatest(message_count // derive.clock_limit().stretch_messages, 1)
        ) AS stretch_ns
    FROM (
        SELECT
            p.run_id, p.clock_id,
            min(p.written_ns) AS start_ns,
            max(p.written_ns) AS end_ns,
            any_value(m.message_count) AS message_count
        FROM published AS p
        JOIN (
            SELECT
                p.clock_id,
                count(DISTINCT m.source_timestamp_ns) AS message_count
            FROM message AS m
            JOIN (SELECT DISTINCT clock_id, topic_name FROM published) AS p
                ON m.topic_name = p.topic_name
            GROUP BY p.clock_id
        ) AS m ON p.clock_id = m.clock_id
        GROUP BY p.run_id, p.clock_id
    )
),
publisher AS (
    SELECT
        run_id, clock_id, topic_name, publisher_id,
        count(*) OVER (PARTITION BY topic_name) AS publisher_count
    FROM published
    GROUP BY run_id, clock_id, topic_name, publisher_id
),
heard AS (
    SELECT
        m.run_id, p.clock_id, p.publisher_id, p.publisher_count, m.source_timestamp_ns,
        m.only_subscription_id,
        m.clock_id AS taken_clock_id,
        m.taken_ns, x.stretch_ns,
        m.source_timestamp_ns BETWEEN x.start_ns AND x.end_ns AS is_in_time
    FROM message AS m
    JOIN publisher AS p ON m.run_id = p.run_id AND m.topic_name = p.topic_name
    JOIN extent AS x ON p.clock_id = x.clock_id
),
-- How far another clock is from this one, but for the drift: the least time from stamp to take, in
-- the beginning and in the end. If a clock was set meanwhile, the clock of stamps is right before
-- that or behind it: it was set wrong, or a robot set right the clock that it had started with.
apart AS (
    SELECT
        clock_id, taken_clock_id,
        min(taken_ns - source_timestamp_ns) FILTER (taken_ns < first_ns + stretch_ns)
            AS first_apart_ns,
        min(taken_ns - source_timestamp_ns) FILTER (taken_ns > last_ns - stretch_ns)
            AS last_apart_ns
    FROM (
        SELECT
            clock_id, taken_clock_id, taken_ns, source_timestamp_ns, stretch_ns,
            min(taken_ns) OVER between_clocks AS first_ns,
            max(taken_ns) OVER between_clocks AS last_ns
        FROM heard
        WHERE is_in_time
        WINDOW between_clocks AS (PARTITION BY clock_id, taken_clock_id)
    )
    GROUP BY clock_id, taken_clock_id
),
-- Where a clock was set, its stamps say little of when messages were published. When they were
-- taken does, on whatever clock.
placed AS (
    SELECT
        h.run_id, h.clock_id, h.publisher_id, h.publisher_count, h.source_timestamp_ns,
        h.only_subscription_id,
        bool_or(h.taken_clock_id = h.clock_id) AS is_taken_here,
        coalesce(
            min(CASE WHEN h.taken_clock_id = h.clock_id THEN h.taken_ns END),
            min(h.taken_ns - a.first_apart_ns),
            h.source_timestamp_ns
        ) AS near_ns,
        min(h.taken_ns - a.last_apart_ns) AS also_near_ns,
        CASE WHEN any_value(h.is_in_time) THEN h.source_timestamp_ns END AS stamped_ns
    FROM heard AS h
    LEFT JOIN apart AS a ON h.clock_id = a.clock_id AND h.taken_clock_id = a.taken_clock_id
    GROUP BY
        h.run_id, h.clock_id, h.publisher_id, h.publisher_count, h.source_timestamp_ns,
        h.only_subscription_id
),
turn AS (
    SELECT
        *,
        lag(source_timestamp_ns) OVER (
            PARTITION BY publisher_id, only_subscription_id ORDER BY source_timestamp_ns
        ) AS earlier_timestamp_ns,
        -- The stamp of a message that was taken here says about when it was published: the message
        -- of the stretch that waited least shows how far the clock of stamps is from this one.
        CASE WHEN is_taken_here THEN
            (
                greatest(
                    least(
                        source_timestamp_ns + min(near_ns - source_timestamp_ns) OVER together,
                        end_ns
                    ),
                    start_ns
                ) - start_ns
            ) // stretch_ns
        END AS only_stretch,
        row_number() OVER (
            PARTITION BY publisher_id, stretch
            ORDER BY hash(source_timestamp_ns), source_timestamp_ns
        ) AS turn
    FROM (
        SELECT
            q.*, x.start_ns, x.end_ns, x.stretch_ns,
            (q.near_ns - x.start_ns) // x.stretch_ns AS stretch
        FROM placed AS q
        JOIN extent AS x ON q.clock_id = x.clock_id
    )
    WINDOW together AS (PARTITION BY clock_id, is_taken_here, stretch)
),
sampled AS (
    SELECT
        run_id, clock_id, publisher_id, source_timestamp_ns, earlier_timestamp_ns, is_taken_here,
        near_ns, also_near_ns, stamped_ns, start_ns, stretch_ns, only_stretch
    FROM turn
    QUALIFY row_number() OVER (
        PARTITION BY clock_id, stretch
        ORDER BY publisher_count, turn, source_timestamp_ns, publisher_id
    ) <= derive.clock_limit().sampled_messages
),
-- A message may have waited in a queue while more than `reach` others were published. Clocks of one
-- machine are close, so its publication is then among those around its stamp. A moment before the
-- first publication tells nothing.
moment AS (
    SELECT
        s.run_id, s.clock_id, s.publisher_id, s.source_timestamp_ns, s.earlier_timestamp_ns,
        s.start_ns, s.stretch_ns, s.only_stretch,
        CASE WHEN s.is_taken_here THEN s.near_ns END AS taken_ns,
        s.place, p.position
    FROM (
        SELECT
            *,
            unnest([
                stamped_ns, near_ns, CASE WHEN NOT is_taken_here THEN also_near_ns END
            ]) AS at_ns,
            unnest([1, 2, 3]) AS place
        FROM sampled
    ) AS s
    ASOF JOIN published AS p ON s.publisher_id = p.publisher_id AND s.at_ns >= p.written_ns
),
wanted AS (
    SELECT
        run_id, clock_id, publisher_id, source_timestamp_ns, earlier_timestamp_ns, start_ns,
        stretch_ns, only_stretch, taken_ns,
        arg_min(position, place) AS latest_position,
        unnest(
            list_distinct(
                flatten(
                    list(
                        range(
                            position - derive.clock_limit().reach,
                            position + derive.clock_limit().reach + 1
                        )
                    )
                )
            )
        ) AS position
    FROM moment
    GROUP BY
        run_id, clock_id, publisher_id, source_timestamp_ns, earlier_timestamp_ns, start_ns,
        stretch_ns, only_stretch, taken_ns
),
paired AS (
    SELECT
        w.run_id, w.clock_id, w.publisher_id, w.start_ns, w.stretch_ns,
        w.taken_ns IS NOT NULL AS is_taken_here,
        w.position = w.latest_position AS is_latest,
        p.written_ns,
        coalesce(w.only_stretch, (p.written_ns - w.start_ns) // w.stretch_ns) AS stretch,
        w.source_timestamp_ns - p.written_ns AS greatest_ns,
        w.source_timestamp_ns - p.closes_ns AS least_ns,
        w.source_timestamp_ns - p.next_written_ns AS later_ns,
        w.earlier_timestamp_ns - p.written_ns AS earlier_ns
    FROM wanted AS w
    JOIN published AS p
        ON w.publisher_id = p.publisher_id
        AND w.position = p.position
        AND p.written_ns <= coalesce(w.taken_ns, p.written_ns)
)
SELECT
    run_id, clock_id, publisher_id, start_ns, stretch_ns, stretch, written_ns,
    written_ns - start_ns - stretch * stretch_ns - stretch_ns // 2 AS beyond_middle_ns,
    is_taken_here, is_latest,
    greatest(least_ns, later_ns, earlier_ns) AS least_ns,
    greatest_ns
FROM paired
WHERE coalesce(later_ns < greatest_ns, true)
