-- description: Messages matched with publications that carry no stamp. A message was stamped after
--     its publication was written, and before the publishing thread went on; all writes on the
--     topic that go on at that moment come into question, or go on within the slack of the clocks.
--     A message has one publication and a publication one message, the first. A message has no
--     publication where that would be a guess: where several come into question; where two
--     messages may both be of one publication, and come as soon as usual; where others publish
--     on the topic, and it came later or sooner than is usual; where its clock was set, or the
--     difference of the clocks is not known or explains less than half of the messages of each
--     topic.
-- grain: one row per message that has, or might have, a publication
-- when: derive.unstamped_call
CREATE OR REPLACE MACRO derive.nearest_message(only_run) AS TABLE
WITH published AS MATERIALIZED (
    SELECT
        clock_id, topic_name, publisher_id, thread_id, publication_id, written_ns, closes_ns,
        goes_on
    FROM derive.unstamped_publication(only_run)
),
heard AS (
    SELECT
        m.run_id, m.topic_name, m.source_timestamp_ns, m.only_subscription_id, p.publisher_id,
        p.clock_id,
        min(CASE WHEN m.clock_id = p.clock_id THEN m.taken_ns END) AS taken_ns
    FROM derive.unstamped_message(only_run) AS m
    JOIN (SELECT DISTINCT clock_id, topic_name, publisher_id FROM published) AS p
        ON m.topic_name = p.topic_name
    GROUP BY
        m.run_id, m.topic_name, m.source_timestamp_ns, m.only_subscription_id, p.publisher_id,
        p.clock_id
),
-- When each message was stamped, by the clock of the trace.
message AS MATERIALIZED (
    SELECT
        h.*,
        c.slack_ns,
        c.clock_id IS NULL AND EXISTS (
            FROM store.stamp_clock AS k WHERE k.run_id = only_run AND k.clock_id = h.clock_id
        ) AS is_set,
        derive.stamped_ns(h.source_timestamp_ns, c.at_ns, c.difference_ns, c.drift_ppb)
            AS stamped_ns
    FROM heard AS h
    LEFT JOIN store.stamp_clock AS c
        ON c.run_id = only_run
        AND h.clock_id = c.clock_id
        AND h.source_timestamp_ns >= coalesce(c.start_ns, h.source_timestamp_ns)
        AND h.source_timestamp_ns <= coalesce(c.end_ns, h.source_timestamp_ns)
),
-- Threads that share a publisher write at the same time; one alone never does.
beside AS (
    SELECT DISTINCT
        m.topic_name, m.source_timestamp_ns, m.only_subscription_id, m.stamped_ns, m.slack_ns,
        m.taken_ns, p.*
    FROM (
        SELECT
            m.*, t.thread_id,
            unnest([stamped_ns - slack_ns, stamped_ns + slack_ns]) AS near_ns
        FROM message AS m
        JOIN (SELECT DISTINCT publisher_id, thread_id FROM published) AS t
            ON m.publisher_id = t.publisher_id
    ) AS m
    ASOF JOIN published AS p
        ON m.publisher_id = p.publisher_id
        AND m.thread_id = p.thread_id
        AND m.near_ns >= p.written_ns
),
within AS MATERIALIZED (
    SELECT
        topic_name, clock_id, publisher_id, source_timestamp_ns, only_subscription_id,
        publication_id, goes_on,
        stamped_ns - written_ns AS delay_ns,
        stamped_ns < written_ns OR stamped_ns >= closes_ns AS is_missed,
        row_number() OVER (
            PARTITION BY publication_id, only_subscription_id ORDER BY source_timestamp_ns
        ) AS place
    FROM beside
    WHERE coalesce(written_ns < taken_ns, true)
        AND stamped_ns - slack_ns < closes_ns
),
-- A message that came while none of the known publishers wrote is of another one, or its
-- publication was lost. Where nothing is lost, there is another one.
strange AS MATERIALIZED (
    SELECT DISTINCT m.topic_name
    FROM message AS m
    JOIN (
        SELECT
            topic_name,
            min(written_ns) AS first_ns,
            max(written_ns) AS last_ns
        FROM published
        GROUP BY topic_name
    ) AS p ON m.topic_name = p.topic_name
    ANTI JOIN within AS w
        ON m.topic_name = w.topic_name AND m.source_timestamp_ns = w.source_timestamp_ns
    WHERE m.stamped_ns BETWEEN p.first_ns AND p.last_ns
        AND NOT EXISTS (FROM derive.recording_gap AS g WHERE g.run_id = only_run)
),
-- How long after the begin of a write messages come: half of those of a host, and nearly all of a
-- publisher, at least and at most.
usual AS (
    SELECT
        publisher_id,
        any_value(median_ns) AS median_ns,
        quantile_disc(delay_ns, 1 - derive.clock_limit().usual_quantile) AS soonest_ns,
        quantile_disc(delay_ns, derive.clock_limit().usual_quantile) AS latest_ns
    FROM (
        SELECT
            *,
            median(delay_ns) OVER (PARTITION BY clock_id) AS median_ns
        FROM within
    )
    WHERE goes_on AND place = 1
    GROUP BY publisher_id
),
-- All that a message may be of. Several writes may go on at the moment of its stamp.
candidate AS MATERIALIZED (
    SELECT
        w.*,
        count(*) OVER (
            PARTITION BY w.topic_name, w.source_timestamp_ns, w.only_subscription_id
        ) AS candidate_count,
        coalesce(w.delay_ns <= u.latest_ns, false) AS is_prompt,
        w.topic_name IN (FROM strange)
        AND NOT coalesce(
            w.delay_ns <= derive.clock_limit().usual_factor * u.median_ns
            AND derive.clock_limit().usual_factor * w.delay_ns >= u.soonest_ns,
            false
        ) AS is_unusual
    FROM within AS w
    LEFT JOIN usual AS u ON w.publisher_id = u.publisher_id
),
-- A publication that is all a message may be of has that message: no other is of it. It has the
-- first of several, unless others came as soon.
owned AS MATERIALIZED (
    SELECT
        publication_id, only_subscription_id,
        min(source_timestamp_ns) AS source_timestamp_ns,
        count_if(is_prompt) > 1 AS is_rivalled
    FROM candidate
    WHERE candidate_count = 1
    GROUP BY publication_id, only_subscription_id
),
left_over AS (
    SELECT
        c.topic_name, c.publisher_id, c.source_timestamp_ns, c.only_subscription_id,
        c.publication_id,
        c.is_missed OR c.is_unusual OR coalesce(o.is_rivalled, false) AS is_doubtful,
        count(*) OVER (
            PARTITION BY c.topic_name, c.source_timestamp_ns, c.only_subscription_id
        ) AS candidate_count
    FROM candidate AS c
    LEFT JOIN owned AS o
        ON c.publication_id = o.publication_id
        AND c.only_subscription_id = o.only_subscription_id
    WHERE coalesce(c.source_timestamp_ns = o.source_timestamp_ns, true)
        OR (o.is_rivalled AND c.candidate_count = 1 AND c.is_prompt)
),
matched AS (
    SELECT
        topic_name, publisher_id, source_timestamp_ns, only_subscription_id, publication_id,
        is_doubtful
        OR count(*) OVER (PARTITION BY publication_id, only_subscription_id, candidate_count) > 1
            AS is_doubtful
    FROM left_over
),
-- The right difference of the clocks explains the messages; one that fits few of them is wrong.
-- Some topics may have publishers that were not traced, but hardly all.
trusted AS (
    SELECT clock_id
    FROM (
        SELECT
            m.clock_id, m.topic_name,
            count(DISTINCT m.source_timestamp_ns) AS message_count,
            count(DISTINCT x.source_timestamp_ns) AS matched_count
        FROM message AS m
        LEFT JOIN matched AS x
            ON m.publisher_id = x.publisher_id AND m.source_timestamp_ns = x.source_timestamp_ns
        WHERE m.stamped_ns IS NOT NULL
        GROUP BY m.clock_id, m.topic_name
    )
    GROUP BY clock_id
    HAVING coalesce(
        max(
            CASE WHEN message_count >= derive.clock_limit().quorum
                THEN matched_count / message_count END
        ),
        sum(matched_count) / sum(message_count)
    ) >= derive.clock_limit().explained_share
)
SELECT
    m.run_id, m.topic_name, m.source_timestamp_ns,
    CASE
        WHEN count(DISTINCT x.publication_id) = 1
            AND NOT bool_or(coalesce(x.is_doubtful, m.is_set))
            AND bool_and(x.publication_id IS NULL OR m.clock_id IN (FROM trusted))
            THEN any_value(x.publication_id)
    END AS publication_id,
    CASE WHEN NOT bool_or(m.is_set) THEN count(DISTINCT x.publication_id) END AS candidate_count
FROM message AS m
LEFT JOIN matched AS x
    ON m.publisher_id = x.publisher_id AND m.source_timestamp_ns = x.source_timestamp_ns
GROUP BY m.run_id, m.topic_name, m.source_timestamp_ns
HAVING count(x.publication_id) > 0
    OR bool_or(m.stamped_ns IS NULL OR m.clock_id NOT IN (FROM trusted))
