-- description: Messages matched with publications that carry no stamp. A message was stamped after
--     its publication was written, and before the publishing thread went on; all writes on the
--     topic that go on at that moment come into question. A message has one publication and a
--     publication one message, the first. Where a publisher writes for much of the time, or what
--     the thread did next is not known, or publishers are not traced, the delays that are usual
--     bound the search. A message has no publication where that would be a guess: where several
--     come into question; where two messages may both be of one publication; where another
--     publication or message is within what a drift could move it, if the drift is not known; if it
--     was stamped sooner after a publication than is usual, and another publication may be lost; if
--     the thread was writing another just before; if others publish on the topic, and it came
--     sooner than this publisher's messages do. Nearly all messages come some time after their
--     write, and the difference of the clocks may be wrong by that time. Nor has it one where the
--     difference of the clocks is not known, or explains less than half of the messages.
-- grain: one row per message that has, or might have, a publication
-- when: store.stamp_clock
CREATE OR REPLACE MACRO derive.nearest_message(only_run) AS TABLE
WITH course AS MATERIALIZED (FROM derive.certain_clock(only_run)),
step AS MATERIALIZED (FROM derive.clock_step(only_run)),
started AS (
    SELECT
        * EXCLUDE (start_ns),
        start_ns AS first_ns,
        CASE
            WHEN lag(start_ns) OVER (PARTITION BY clock_id ORDER BY start_ns) IS NULL
                THEN -9223372036854775807
            ELSE start_ns
        END AS start_ns
    FROM course
),
located AS (
    SELECT
        b.run_id, b.clock_id, b.topic_name, b.publisher_id, b.thread_id, b.publication_id,
        b.written_ns, b.next_event_ns, b.has_break, c.segment, c.is_certain,
        c.difference_ns
        + round((b.written_ns - c.at_ns)::DOUBLE * c.drift_ppb / 1e9)::BIGINT AS then_ns,
        -- Where the drift is not known, it may be any that clocks have, also among the messages
        -- that vote.
        CASE
            WHEN NOT c.is_sharp
                THEN round(
                    (abs(b.written_ns - c.at_ns) + c.at_ns - c.first_ns)::DOUBLE
                    * derive.clock_limit().drift_ppb / 1e9
                )::BIGINT
            ELSE 0
        END AS wander_ns
    FROM derive.unstamped_publication(only_run) AS b
    ASOF JOIN started AS c ON b.clock_id = c.clock_id AND b.written_ns >= c.start_ns
),
published AS MATERIALIZED (
    SELECT
        segment, clock_id, topic_name, publisher_id, thread_id, publication_id, written_ns,
        written_ns + then_ns AS opens_ns,
        next_event_ns + then_ns AS closes_ns,
        next_event_ns IS NOT NULL AND NOT has_break AS goes_on,
        lag(next_event_ns + then_ns) OVER (
            PARTITION BY segment, publisher_id, thread_id ORDER BY written_ns, publication_id
        ) AS closed_ns,
        wander_ns,
        wander_ns > 0 AND coalesce(
            least(
                written_ns - lag(written_ns) OVER on_topic,
                lead(written_ns) OVER on_topic - written_ns
            ) <= 2 * wander_ns,
            false
        ) AS is_crowded
    FROM located
    WHERE is_certain
    WINDOW on_topic AS (PARTITION BY segment, topic_name ORDER BY written_ns, publication_id)
),
-- The stamps from one step to the next, and those around a step. Before the first stretch and
-- behind the last one a clock is as in it.
segment AS MATERIALIZED (
    SELECT
        clock_id, segment,
        CASE WHEN clock_id IN (SELECT clock_id FROM step)
            THEN min(2 * start_ns - end_ns + difference_ns)
            ELSE -9223372036854775807 END AS first_stamp_ns,
        CASE WHEN clock_id IN (SELECT clock_id FROM step)
            THEN max(2 * end_ns - start_ns + difference_ns)
            ELSE 9223372036854775807 END AS last_stamp_ns
    FROM course
    WHERE is_certain
    GROUP BY clock_id, segment
    UNION ALL
    SELECT
        clock_id, NULL,
        start_ns + unnest(differences_ns),
        end_ns + unnest(differences_ns)
    FROM step
),
publisher AS (SELECT DISTINCT run_id, clock_id, topic_name, publisher_id FROM located),
heard AS (
    SELECT
        m.run_id, m.topic_name, m.source_timestamp_ns, m.only_subscription_id, p.publisher_id,
        p.clock_id,
        min(CASE WHEN m.clock_id = p.clock_id THEN m.taken_ns END) AS taken_ns
    FROM derive.unstamped_message(only_run) AS m
    JOIN publisher AS p ON m.run_id = p.run_id AND m.topic_name = p.topic_name
    GROUP BY
        m.run_id, m.topic_name, m.source_timestamp_ns, m.only_subscription_id, p.publisher_id,
        p.clock_id
),
-- A message that was taken on this clock is of the time in which it was taken: it did not wait
-- while the clock was set. Another one may be of two times where the clock was set back. Then it is
-- of neither.
message AS MATERIALIZED (
    SELECT
        *,
        segment IS NULL AND clock_id IN (SELECT clock_id FROM step) AS is_set
    FROM (
        SELECT
            h.*,
            CASE
                WHEN count(h.taken_ns) > 0
                    THEN any_value(g.segment) FILTER (c.is_certain AND c.segment = g.segment)
                WHEN count(*) = 1 THEN any_value(g.segment)
            END AS segment
        FROM heard AS h
        ASOF LEFT JOIN started AS c ON h.clock_id = c.clock_id AND h.taken_ns >= c.start_ns
        LEFT JOIN segment AS g
            ON h.clock_id = g.clock_id
            AND h.source_timestamp_ns BETWEEN g.first_stamp_ns AND g.last_stamp_ns
        GROUP BY ALL
    )
),
-- Threads that share a publisher write at the same time; one alone never does.
looked_for AS (
    SELECT
        m.topic_name, m.publisher_id, p.thread_id, m.source_timestamp_ns, m.only_subscription_id,
        m.taken_ns, m.segment
    FROM message AS m
    JOIN (SELECT DISTINCT publisher_id, thread_id, segment FROM published) AS p
        ON m.publisher_id = p.publisher_id AND m.segment = p.segment
),
-- Where the clock is not known sharply, also what a message just missed: the publication before it,
-- or the next one.
beside AS (
    SELECT m.topic_name, m.source_timestamp_ns, m.only_subscription_id, m.taken_ns, p.*
    FROM looked_for AS m
    ASOF JOIN published AS p
        ON m.publisher_id = p.publisher_id
        AND m.thread_id = p.thread_id
        AND m.segment = p.segment
        AND m.source_timestamp_ns >= p.opens_ns
    UNION ALL
    SELECT m.topic_name, m.source_timestamp_ns, m.only_subscription_id, m.taken_ns, p.*
    FROM looked_for AS m
    ASOF JOIN published AS p
        ON m.publisher_id = p.publisher_id
        AND m.thread_id = p.thread_id
        AND m.segment = p.segment
        AND m.source_timestamp_ns < p.opens_ns
    WHERE m.source_timestamp_ns >= p.opens_ns - p.wander_ns
),
looked_up AS MATERIALIZED (
    SELECT
        topic_name, publisher_id, source_timestamp_ns, only_subscription_id, publication_id,
        clock_id, goes_on,
        is_crowded
        OR first_value(source_timestamp_ns) OVER of_publication < opens_ns
        OR coalesce(
            lead(source_timestamp_ns) OVER of_publication - source_timestamp_ns <= 2 * wander_ns,
            false
        ) AS is_crowded,
        source_timestamp_ns - opens_ns AS delay_ns,
        source_timestamp_ns - closed_ns AS closed_for_ns,
        source_timestamp_ns >= opens_ns AND coalesce(source_timestamp_ns < closes_ns, true)
            AS is_within,
        coalesce(source_timestamp_ns < closes_ns + wander_ns, true) AS is_near
    FROM beside
    WHERE coalesce(written_ns < taken_ns, true)
    WINDOW of_publication AS (
        PARTITION BY publication_id, only_subscription_id ORDER BY source_timestamp_ns
    )
),
within AS MATERIALIZED (
    SELECT
        topic_name, publisher_id, source_timestamp_ns, only_subscription_id, publication_id,
        clock_id, goes_on, is_crowded, delay_ns, closed_for_ns,
        row_number() OVER (
            PARTITION BY publication_id, only_subscription_id ORDER BY source_timestamp_ns
        ) AS place
    FROM looked_up
    WHERE is_within
),
missed AS MATERIALIZED (
    SELECT DISTINCT topic_name, source_timestamp_ns, publication_id
    FROM looked_up
    WHERE is_near AND NOT is_within
),
-- A message that came while none of the known publishers wrote is of another one, or its
-- publication was lost. Where nothing is lost, there is another one.
strange AS MATERIALIZED (
    SELECT DISTINCT m.topic_name
    FROM message AS m
    JOIN (
        SELECT
            topic_name,
            min(opens_ns) AS first_ns,
            max(opens_ns) AS last_ns
        FROM published
        GROUP BY topic_name
    ) AS p ON m.topic_name = p.topic_name
    ANTI JOIN within AS w
        ON m.topic_name = w.topic_name AND m.source_timestamp_ns = w.source_timestamp_ns
    WHERE m.source_timestamp_ns BETWEEN p.first_ns AND p.last_ns
        AND NOT EXISTS (FROM derive.recording_gap AS g WHERE g.run_id = only_run)
),
-- Its messages take the place of those that no reader took.
exposed AS (
    SELECT DISTINCT p.publisher_id
    FROM published AS p
    JOIN (
        SELECT DISTINCT topic_name, only_subscription_id
        FROM message
        WHERE topic_name IN (FROM strange)
    ) AS s ON p.topic_name = s.topic_name
    ANTI JOIN within AS w
        ON p.publication_id = w.publication_id AND s.only_subscription_id = w.only_subscription_id
),
-- How much of the time the publisher was writing: the more, the more messages fall into it by
-- chance.
share AS (
    SELECT
        publisher_id,
        sum(CASE WHEN goes_on THEN closes_ns - opens_ns END)
        / greatest(max(opens_ns) - min(opens_ns), 1) AS writing
    FROM published
    GROUP BY publisher_id
),
usual AS (
    SELECT
        w.publisher_id,
        CASE
            WHEN any_value(s.writing) > derive.clock_limit().writing_share
                THEN greatest(
                    derive.clock_limit().write_ns,
                    derive.clock_limit().median_factor * median(w.delay_ns)
                )
        END AS limit_ns,
        quantile_disc(w.delay_ns, derive.clock_limit().usual_quantile) AS usual_ns,
        -- Delays have a least one, and few are near it.
        3 * quantile_disc(w.delay_ns, 0.1) - 2 * median(w.delay_ns) AS soonest_ns,
        -- What 99 % of a few messages need says little of the next one.
        count(*) * (1 - derive.clock_limit().usual_quantile) < 1 AS is_little_known
    FROM within AS w
    JOIN share AS s ON w.publisher_id = s.publisher_id
    WHERE w.place = 1 AND w.goes_on
    GROUP BY w.publisher_id
),
-- If a publisher was never seen to go on, what is usual on its host is expected of it. A message
-- that comes much sooner than nearly all others may be of another publication, if one may be lost.
usual_of_clock AS (
    SELECT
        clock_id,
        quantile_disc(delay_ns, derive.clock_limit().usual_quantile) AS usual_ns,
        quantile_disc(delay_ns, 1 - derive.clock_limit().usual_quantile) AS least_ns,
        -- A message soon behind another write may be of that one, and shows nothing.
        quantile_disc(delay_ns, 1 - derive.clock_limit().usual_quantile)
            FILTER (coalesce(closed_for_ns >= derive.clock_limit().burst_ns, true)) AS alone_ns,
        -- The usual delay of topics without other publishers, if enough messages show it.
        CASE
            WHEN count(*) FILTER (topic_name NOT IN (FROM strange))
                * (1 - derive.clock_limit().usual_quantile) >= 1
                THEN quantile_disc(delay_ns, derive.clock_limit().usual_quantile)
                    FILTER (topic_name NOT IN (FROM strange))
            ELSE derive.clock_limit().median_factor * median(delay_ns)
        END AS familiar_ns
    FROM within
    WHERE place = 1 AND goes_on
    GROUP BY clock_id
),
-- All that a message may be of. Several writes may go on at the moment of its stamp.
candidate AS MATERIALIZED (
    SELECT
        *,
        count(*) OVER (
            PARTITION BY topic_name, source_timestamp_ns, only_subscription_id
        ) AS candidate_count
    FROM (
        SELECT
            w.topic_name, w.source_timestamp_ns, w.only_subscription_id, w.publisher_id,
            w.publication_id, w.goes_on, w.delay_ns,
            w.is_crowded OR coalesce(w.closed_for_ns < c.alone_ns, false) AS is_crowded,
            w.delay_ns <= u.usual_ns AS is_prompt,
            c.least_ns,
            CASE
                WHEN x.publisher_id IS NOT NULL
                    THEN coalesce(w.delay_ns BETWEEN u.soonest_ns AND c.familiar_ns, false)
                WHEN w.goes_on THEN coalesce(w.delay_ns <= u.limit_ns, true)
                ELSE w.delay_ns <= coalesce(
                    derive.clock_limit().usual_factor * CASE
                        WHEN u.is_little_known THEN greatest(u.usual_ns, c.usual_ns)
                        ELSE coalesce(u.usual_ns, c.usual_ns)
                    END,
                    derive.clock_limit().write_ns
                )
            END AS is_usual
        FROM within AS w
        LEFT JOIN usual AS u ON w.publisher_id = u.publisher_id
        LEFT JOIN usual_of_clock AS c ON w.clock_id = c.clock_id
        LEFT JOIN exposed AS x ON w.publisher_id = x.publisher_id
    )
    -- Whether a thread that is not seen to go on still writes is known by what is usual alone.
    WHERE is_usual OR goes_on
),
-- A publication that is all a message may be of has that message: the first of several, unless
-- others came as soon. So no other message is of it.
owned AS MATERIALIZED (
    SELECT
        topic_name, source_timestamp_ns, only_subscription_id, publication_id, is_usual,
        lead(is_prompt) OVER on_publication AS is_rivalled,
        row_number() OVER on_publication AS place
    FROM candidate
    WHERE candidate_count = 1
    WINDOW on_publication AS (
        PARTITION BY publication_id, only_subscription_id ORDER BY source_timestamp_ns
    )
),
-- Large messages take long to write. One that comes much sooner than nearly all others of its
-- publisher may be of a publication that was lost. Messages that others may have written do not
-- count.
soonest AS (
    SELECT
        publisher_id,
        quantile_disc(delay_ns, 1 - derive.clock_limit().usual_quantile) AS least_ns
    FROM candidate
    WHERE candidate_count = 1
    GROUP BY publisher_id
),
left_over AS (
    SELECT
        c.topic_name, c.source_timestamp_ns, c.only_subscription_id, c.publisher_id,
        c.publication_id, c.is_crowded, c.is_usual, c.is_prompt,
        coalesce(
            derive.clock_limit().usual_factor * c.delay_ns < greatest(u.least_ns, c.least_ns),
            false
        ) AS is_hasty,
        count(*) OVER (
            PARTITION BY c.topic_name, c.source_timestamp_ns, c.only_subscription_id
        ) AS candidate_count
    FROM candidate AS c
    LEFT JOIN owned AS o
        ON c.publication_id = o.publication_id
        AND c.only_subscription_id = o.only_subscription_id
        AND c.source_timestamp_ns <> o.source_timestamp_ns
        AND o.place = 1
    LEFT JOIN soonest AS u ON c.publisher_id = u.publisher_id
    WHERE o.publication_id IS NULL
        OR NOT o.is_usual
        OR (o.is_rivalled AND c.candidate_count = 1 AND c.is_prompt)
),
hasty AS MATERIALIZED (SELECT DISTINCT publication_id FROM left_over WHERE is_hasty),
doubtful AS (FROM derive.publication_beside_gap('hasty')),
matched AS (
    SELECT
        topic_name, publisher_id, source_timestamp_ns, only_subscription_id, publication_id,
        is_crowded
        OR NOT is_usual
        OR count(*) OVER (PARTITION BY publication_id, only_subscription_id, candidate_count) > 1
        OR (is_hasty AND publication_id IN (FROM doubtful))
        OR EXISTS (
            FROM missed AS m
            WHERE m.topic_name = left_over.topic_name
                AND m.source_timestamp_ns = left_over.source_timestamp_ns
                AND m.publication_id <> left_over.publication_id
        ) AS is_rivalled
    FROM left_over
),
-- The right difference of the clocks explains the messages; one that fits few of them is wrong.
-- Some topics may have publishers that were not traced, but hardly all.
explained AS (
    SELECT
        clock_id, segment, topic_name,
        count(*) AS message_count,
        sum(CASE WHEN is_matched THEN 1 ELSE 0 END) AS matched_count
    FROM (
        SELECT
            m.clock_id, m.segment, m.topic_name, m.source_timestamp_ns,
            bool_or(x.publication_id IS NOT NULL) AS is_matched
        FROM message AS m
        LEFT JOIN matched AS x
            ON m.publisher_id = x.publisher_id AND m.source_timestamp_ns = x.source_timestamp_ns
        GROUP BY m.clock_id, m.segment, m.topic_name, m.source_timestamp_ns
    )
    GROUP BY clock_id, segment, topic_name
),
trusted AS (
    SELECT
        clock_id, segment,
        coalesce(
            max(
                CASE WHEN message_count >= derive.clock_limit().quorum
                    THEN matched_count / message_count END
            ),
            sum(matched_count) / sum(message_count)
        ) >= derive.clock_limit().explained_share AS is_trusted
    FROM explained
    GROUP BY clock_id, segment
)
SELECT
    m.run_id, m.topic_name, m.source_timestamp_ns,
    CASE
        WHEN count(DISTINCT x.publication_id) = 1
            AND NOT bool_or(coalesce(x.is_rivalled, false))
            AND bool_and(x.publication_id IS NULL OR t.is_trusted)
            AND NOT bool_or(m.is_set)
            THEN any_value(x.publication_id)
    END AS publication_id,
    CASE WHEN NOT bool_or(m.is_set) THEN count(DISTINCT x.publication_id) END AS candidate_count
FROM message AS m
LEFT JOIN trusted AS t ON m.clock_id = t.clock_id AND m.segment = t.segment
LEFT JOIN matched AS x
    ON m.publisher_id = x.publisher_id AND m.source_timestamp_ns = x.source_timestamp_ns
GROUP BY m.run_id, m.topic_name, m.source_timestamp_ns
HAVING count(x.publication_id) > 0 OR bool_or(m.segment IS NULL OR NOT t.is_trusted)
