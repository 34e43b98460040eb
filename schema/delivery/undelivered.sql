-- description: Why a subscription did not take a message of its topic; the first reason that holds.
--     Everything is compared on the clock of the receiver. A message is lost only between two of
--     its publisher that were taken: without one, the two were never connected; before the first,
--     not yet; after the last, whether they still were does not show. `not_delivered` rests on a
--     wait: a message in the queue would have ended it. A wait tells this only where a single
--     thread reads, and only if it lasted ten times as long as messages usually need, at least a
--     millisecond. A reader that gets no CPU seems to wait, too, but takes the message when it
--     wakes up. Only the depth of the queue tells `overwritten` from `lost_in_transport`. A take
--     that cannot be identified may have been of the message. Then the reason is unknown: if it
--     came before a later message was taken, or within ten times the usual time. What came from
--     another clock may have come before it seems to: known messages tell how far the clocks are
--     apart, and one that is not known may have been faster. Messages are in order only if one
--     thread sends them with one publisher, and one thread takes them. A publisher may keep
--     messages for subscriptions that come later. Those of its process take them from a ring
--     buffer, where nothing identifies them. Agnocast loses nothing: what a reader passed over was
--     overwritten.
-- grain: one row per publication and subscription of its topic that is not known to have taken it
-- param: has_gaps BOOLEAN = true  The recording has gaps; false: none is looked up
-- param: has_pauses BOOLEAN = true  Likewise pauses
-- param: has_steps BOOLEAN = true  A clock was set; false: no step is looked up
-- param: has_failed_takes BOOLEAN = true  Takes failed; false: none is looked up
-- param: has_orphans BOOLEAN = true  Takes have no publication; false: none is looked up
-- param: has_clocks BOOLEAN = true  There are several clocks; false: all times are of one
-- param: has_open_callbacks BOOLEAN = true  Callbacks have no end; false: none is looked up
CREATE OR REPLACE MACRO derive.undelivered(
    only_run, has_gaps := true, has_pauses := true, has_steps := true, has_failed_takes := true,
    has_orphans := true, has_clocks := true, has_open_callbacks := true
) AS TABLE
WITH arrival AS MATERIALIZED (
    SELECT
        publication_id, publisher_id, topic_name, clock_id, source_timestamp_ns, arrival_ns,
        has_one_clock,
        row_number() OVER (
            PARTITION BY topic_name, clock_id ORDER BY arrival_ns, publication_id
        ) AS position,
        count(*) OVER (PARTITION BY topic_name, clock_id ORDER BY arrival_ns) AS count_so_far
    FROM derive.expected_arrival
    WHERE run_id = only_run AND (has_clocks OR has_one_clock)
),
life AS MATERIALIZED (
    SELECT
        subscription_id, topic_name, process_id, clock_id, queue_depth, created_ns, last_seen_ns,
        replaced_ns, host_end_ns, only_thread_id, shows_takes, is_agnocast
    FROM derive.subscription_life
    WHERE run_id = only_run AND topic_name IS NOT NULL
),
delivered AS (
    SELECT
        l.publication_id, l.subscription_id,
        min(t.taken_ns) AS taken_ns
    FROM store.link_transport AS l
    JOIN store.take AS t ON l.take_id = t.take_id
    WHERE l.run_id = only_run AND NOT l.is_copy
    GROUP BY l.publication_id, l.subscription_id
),
message AS MATERIALIZED (
    SELECT
        a.publication_id, a.publisher_id, s.subscription_id, a.topic_name, a.clock_id, a.arrival_ns,
        a.has_one_clock, a.position,
        a.source_timestamp_ns IS NULL AS has_no_stamp,
        d.taken_ns
    FROM arrival AS a
    JOIN life AS s ON a.topic_name = s.topic_name AND a.clock_id = s.clock_id
    LEFT JOIN delivered AS d
        ON a.publication_id = d.publication_id AND s.subscription_id = d.subscription_id
    WHERE d.taken_ns IS NULL OR a.arrival_ns IS NOT NULL
),
pace AS (
    SELECT
        subscription_id,
        greatest(max(taken_ns - arrival_ns), derive.delivery_limit().longest_ns) AS longest_ns,
        quantile_disc(taken_ns - arrival_ns, 0.5) AS usual_ns,
        greatest(
            derive.delivery_limit().patience_factor * usual_ns,
            derive.delivery_limit().least_patience_ns
        ) AS patience_ns
    FROM message
    WHERE taken_ns IS NOT NULL
    GROUP BY subscription_id
),
-- With the first take of anything that came later, of the same publisher and of any; what came at
-- the same moment counts with it.
missing AS MATERIALIZED (
    SELECT
        publication_id, publisher_id, subscription_id, topic_name, clock_id, arrival_ns,
        has_one_clock, position, has_no_stamp,
        min(taken_ns) OVER later_of_publisher AS publisher_taken_ns,
        min(arrival_ns) FILTER (taken_ns IS NOT NULL) OVER later_of_publisher
            AS publisher_arrival_ns,
        min(taken_ns) OVER later_of_any AS any_taken_ns,
        min(arrival_ns) FILTER (taken_ns IS NOT NULL) OVER later_of_any AS next_arrival_ns,
        min(arrival_ns) FILTER (taken_ns IS NOT NULL) OVER (
            PARTITION BY subscription_id, publisher_id
        ) AS first_arrival_ns
    FROM message
    WHERE subscription_id IN (SELECT subscription_id FROM message WHERE taken_ns IS NULL)
    WINDOW
        later_of_publisher AS (
            PARTITION BY subscription_id, publisher_id
            ORDER BY arrival_ns DESC NULLS FIRST, taken_ns NULLS FIRST ROWS UNBOUNDED PRECEDING
        ),
        later_of_any AS (
            PARTITION BY subscription_id
            ORDER BY arrival_ns DESC NULLS FIRST, taken_ns NULLS FIRST ROWS UNBOUNDED PRECEDING
        )
    QUALIFY taken_ns IS NULL
),
gap AS MATERIALIZED (FROM derive.process_gap(only_run, has_gaps, has_pauses)),
-- Takes that could be any message, and those that could be one without a stamp.
unidentified AS (
    SELECT
        t.take_id, t.subscription_id, t.taken_ns,
        t.source_timestamp_ns IS NULL AS has_no_stamp,
        t.method = 'ring_buffer' AS is_from_buffer
    FROM store.orphan_take AS o
    JOIN store.take AS t ON o.take_id = t.take_id
    WHERE has_orphans AND o.run_id = only_run
),
-- The first that may be of a message from before: a stamp would identify one that was kept. Before
-- Iron only the callback tells what comes from a buffer.
first_unidentified AS (
    SELECT
        u.subscription_id,
        min(u.taken_ns) FILTER (u.is_from_buffer OR c.is_intra_process) AS from_buffer_ns,
        min(u.taken_ns) FILTER (
            u.has_no_stamp AND (u.is_from_buffer OR c.is_intra_process) IS NOT TRUE
        ) AS other_ns
    FROM unidentified AS u
    LEFT JOIN store.callback_instance AS c ON u.take_id = c.take_id
    GROUP BY u.subscription_id
),
-- The order of messages matters only where a take is not identified.
one_thread AS (
    SELECT publisher_id
    FROM store.publication
    WHERE has_orphans AND run_id = only_run
    GROUP BY publisher_id
    HAVING min(thread_id) = max(thread_id)
),
long_wait AS (
    SELECT s.subscription_id, w.start_ns, w.end_ns
    FROM life AS s
    JOIN derive.executor_interval AS w ON s.only_thread_id = w.thread_id
    LEFT JOIN pace AS p ON s.subscription_id = p.subscription_id
    WHERE w.run_id = only_run
        AND w.state = 'wait'
        AND w.end_ns - w.start_ns > coalesce(p.patience_ns, derive.delivery_limit().longest_ns)
        AND s.subscription_id IN (SELECT subscription_id FROM missing)
),
-- While a clock is set, no take shows which message it is of.
while_set AS (
    SELECT b.publication_id
    FROM derive.clock_step(only_run) AS z
    JOIN store.host AS h ON z.clock_id = h.clock_id
    JOIN store.process AS o ON h.host_id = o.host_id
    JOIN store.publication AS b
        ON o.process_id = b.process_id
        AND b.end_ns >= coalesce(z.start_ns, 0)
        AND b.end_ns <= coalesce(z.end_ns, 9223372036854775807)
    WHERE has_steps AND b.run_id = only_run
),
known AS MATERIALIZED (
    SELECT
        m.*, s.process_id, s.queue_depth, s.created_ns, s.last_seen_ns, s.replaced_ns,
        s.host_end_ns, s.only_thread_id, s.shows_takes, s.is_agnocast,
        m.first_arrival_ns IS NOT NULL AS is_connected,
        m.first_arrival_ns > m.arrival_ns AS is_before_first,
        CASE
            WHEN m.has_one_clock OR NOT is_connected THEN m.arrival_ns
            ELSE m.arrival_ns - derive.delivery_limit().stamp_slack_ns
        END AS least_arrival_ns,
        coalesce(c.longest_ns, derive.delivery_limit().longest_ns) AS longest_ns,
        coalesce(c.patience_ns, derive.delivery_limit().longest_ns) AS patience_ns,
        c.usual_ns,
        m.arrival_ns + coalesce(c.patience_ns, derive.delivery_limit().longest_ns) AS due_ns,
        -- From when on publisher and subscription could know each other: they need not have before.
        greatest(
            coalesce(s.created_ns, 0),
            CASE WHEN m.has_one_clock THEN coalesce(b.created_ns, 0) ELSE 0 END
        ) AS introduced_ns,
        s.only_thread_id IS NOT NULL AND t.publisher_id IS NOT NULL AS is_in_order,
        least(CASE WHEN b.process_id = s.process_id THEN k.from_buffer_ns END, k.other_ns)
            AS unidentified_ns,
        unidentified_ns <= coalesce(m.any_taken_ns, unidentified_ns) AS may_be_kept,
        count(*) OVER (PARTITION BY m.subscription_id, m.next_arrival_ns) AS row_length,
        count(*) FILTER (m.arrival_ns <= s.last_seen_ns) OVER (
            PARTITION BY m.subscription_id, m.publisher_id, m.publisher_arrival_ns
        ) AS publisher_row_length,
        min(m.arrival_ns) FILTER (m.arrival_ns > s.last_seen_ns) OVER (
            PARTITION BY m.subscription_id
        ) AS first_unseen_ns
    FROM missing AS m
    JOIN life AS s ON m.subscription_id = s.subscription_id
    JOIN store.publisher AS b ON m.publisher_id = b.publisher_id
    LEFT JOIN pace AS c ON m.subscription_id = c.subscription_id
    LEFT JOIN one_thread AS t ON m.publisher_id = t.publisher_id
    LEFT JOIN first_unidentified AS k ON m.subscription_id = k.subscription_id
    ANTI JOIN derive.copied_pair AS y
        ON m.publisher_id = y.publisher_id AND m.subscription_id = y.subscription_id
),
-- `waited_ns`: when it was certain that the message is not in the queue: the reader waited for
-- long, after the message had arrived, and before the next message that was taken arrived. That
-- tells nothing if the reader may have been kept from the CPU: if it took that next message late,
-- or if as many messages are missing in a row as its queue holds.
bounded AS MATERIALIZED (
    SELECT
        k.*,
        greatest(w.start_ns, k.arrival_ns) + k.patience_ns AS due_by_ns,
        k.next_arrival_ns < w.end_ns
        AND k.any_taken_ns >= w.end_ns
        AND (
            w.end_ns - greatest(w.start_ns, k.next_arrival_ns)
            > derive.delivery_limit().patience_factor * k.usual_ns
            OR k.row_length >= greatest(k.queue_depth, derive.delivery_limit().least_row)
        ) AS is_starved,
        CASE
            WHEN w.end_ns IS NOT NULL
                AND due_by_ns <= least(w.end_ns, k.any_taken_ns, k.next_arrival_ns)
                AND is_starved IS NOT TRUE THEN due_by_ns
        END AS waited_ns,
        coalesce(
            least(k.publisher_taken_ns, waited_ns),
            least(greatest(k.arrival_ns, k.last_seen_ns) + k.longest_ns, k.replaced_ns)
        ) AS until_ns,
        -- A reader that waits for the CPU takes what came by the time it gets it.
        CASE
            WHEN waited_ns IS NOT NULL
                THEN least(k.publisher_taken_ns, w.end_ns + k.patience_ns)
        END AS awake_until_ns,
        coalesce(k.any_taken_ns, least(k.last_seen_ns, k.replaced_ns)) AS gone_ns
    FROM known AS k
    ASOF LEFT JOIN long_wait AS w
        ON k.subscription_id = w.subscription_id AND k.due_ns <= w.end_ns
),
facts AS (
    SELECT
        b.*,
        -- A gap ends at the first event behind it, which may be the publication or the creation.
        g.covered_until_ns > b.arrival_ns AS has_gap,
        i.covered_until_ns > b.introduced_ns AS has_earlier_gap,
        f.failed_ns <= b.until_ns AS has_failed_take,
        -- A later message may have overtaken it, unless one thread sent both, and one takes.
        u.taken_ns <= least(
            CASE WHEN b.is_in_order THEN b.publisher_taken_ns END,
            greatest(b.gone_ns, b.due_ns)
        ) AS has_unidentified_take,
        q.count_so_far - b.position AS newer_count
    FROM bounded AS b
    ASOF LEFT JOIN gap AS g ON b.process_id = g.process_id
        AND coalesce(b.awake_until_ns, b.until_ns) >= g.start_ns
    ASOF LEFT JOIN gap AS i ON b.process_id = i.process_id AND b.arrival_ns >= i.start_ns
    ASOF LEFT JOIN (
        SELECT * FROM derive.empty_take WHERE has_failed_takes AND run_id = only_run
    ) AS f
        ON b.subscription_id = f.subscription_id AND b.arrival_ns <= f.failed_ns
    ASOF LEFT JOIN (
        SELECT
            subscription_id, taken_ns,
            unnest(CASE WHEN has_no_stamp THEN [true, false] ELSE [true] END) AS for_no_stamp
        FROM unidentified
    ) AS u
        ON b.subscription_id = u.subscription_id
        AND b.has_no_stamp = u.for_no_stamp
        AND b.least_arrival_ns <= u.taken_ns
    ASOF LEFT JOIN arrival AS q
        ON b.topic_name = q.topic_name AND b.clock_id = q.clock_id AND b.gone_ns >= q.arrival_ns
),
-- What is said of several messages of a pair alike. Before the first that was taken: whether the
-- queue had overflowed, so that as many newer ones had come as it holds (a queue of one always is
-- full). Behind the last one: whether the reader waited, or many more are missing than before. Of
-- all: whether the trace shows that none was taken, and whether there was time.
judged AS (
    SELECT
        *,
        min(newer_count) OVER stage = queue_depth
        AND queue_depth > 1
        AND count(waited_ns) OVER stage = 0 AS has_overflowed,
        coalesce(count(waited_ns) FILTER (has_unidentified_take IS NOT TRUE) OVER stage > 0, false)
        OR publisher_row_length > queue_depth + coalesce(
            2 * max(publisher_row_length) FILTER (
                publisher_taken_ns IS NOT NULL AND NOT is_before_first
            ) OVER pair,
            0
        ) AS has_stopped,
        min(arrival_ns) FILTER (coalesce(created_ns <= arrival_ns, true)) OVER pair + longest_ns
        < last_seen_ns AS had_time,
        shows_takes AND bool_or(has_unidentified_take) OVER pair IS NOT TRUE AS shows_none
    FROM facts
    WINDOW
        pair AS (PARTITION BY subscription_id, publisher_id),
        stage AS (
            PARTITION BY
                subscription_id, publisher_id, is_before_first, publisher_taken_ns IS NULL
        )
)
SELECT
    only_run::BIGINT AS run_id,
    publication_id, publisher_id, subscription_id,
    CASE
        WHEN arrival_ns IS NULL THEN 'unknown'
        WHEN created_ns > arrival_ns AND may_be_kept THEN 'unknown'
        WHEN created_ns > arrival_ns THEN 'before_subscription'
        WHEN replaced_ns < arrival_ns THEN 'subscription_ended'
        WHEN has_gap THEN 'receiver_gap'
        WHEN arrival_ns > last_seen_ns AND host_end_ns - first_unseen_ns > longest_ns
            THEN CASE WHEN only_thread_id IN (
                SELECT thread_id
                FROM derive.hanging_callback
                WHERE has_open_callbacks AND run_id = only_run
            ) THEN 'reader_in_callback' ELSE 'subscription_ended' END
        WHEN is_agnocast AND any_taken_ns IS NOT NULL THEN 'overwritten'
        WHEN has_unidentified_take THEN 'unknown'
        WHEN publication_id IN (SELECT publication_id FROM while_set WHERE has_steps) THEN 'unknown'
        WHEN NOT is_connected AND shows_none AND had_time THEN 'never_taken'
        WHEN is_before_first THEN CASE
            WHEN has_earlier_gap THEN 'unknown'
            WHEN has_overflowed THEN 'overwritten'
            ELSE 'before_discovery'
        END
        WHEN publisher_taken_ns IS NULL AND is_connected AND has_stopped
            THEN CASE WHEN replaced_ns IS NULL THEN 'no_longer_taken' ELSE 'subscription_ended' END
        WHEN publisher_taken_ns IS NOT NULL AND has_failed_take THEN 'take_failed'
        WHEN publisher_taken_ns IS NOT NULL AND waited_ns IS NOT NULL THEN 'not_delivered'
        WHEN is_connected AND newer_count >= queue_depth THEN 'overwritten'
        WHEN publisher_taken_ns IS NOT NULL AND newer_count < queue_depth
            THEN 'lost_in_transport'
        WHEN any_taken_ns IS NULL AND (newer_count < queue_depth OR newer_count = 0)
            THEN CASE WHEN replaced_ns IS NULL THEN 'pending_at_end' ELSE 'subscription_ended' END
        ELSE 'unknown'
    END AS reason
FROM judged
