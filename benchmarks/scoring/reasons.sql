-- What became of the messages of a simulation, and what of that the trace decides. Nothing is
-- excused but by a hole (see holes.sql) in the very time that the reason is about.

-- Whether takes have an event of their own (not before Humble), and what leaves a ring buffer.
CREATE OR REPLACE TEMP TABLE truth_layout AS
SELECT
    coalesce(bool_or(event = 'ros2:rmw_take'), false) AS has_take,
    coalesce(bool_or(event = 'ros2:rclcpp_ring_buffer_dequeue'), false) AS has_dequeue
FROM simulated_declared;

-- Messages of one topic with one stamp.
CREATE OR REPLACE TEMP TABLE truth_equal_stamp AS
SELECT publication_id
FROM simulated_publication
QUALIFY count(*) OVER (PARTITION BY topic_name, source_timestamp_ns) > 1;

-- What the middleware brought to subscriptions that got the message from a ring buffer as well, or
-- would have, had it not been overwritten there.
CREATE OR REPLACE TEMP TABLE truth_copy AS
SELECT take_id
FROM simulated_take
WHERE method = 'rmw'
    AND (publication_id, subscription_id) IN (
        SELECT (publication_id, subscription_id) FROM simulated_take WHERE method = 'ring_buffer'
        UNION
        SELECT (publication_id, subscription_id) FROM simulated_undelivered
    );

-- Links by time that the trace decides and that were not found: counted as missing, so neither their
-- reasons are judged as well, nor what follows from their takes not being known.
CREATE OR REPLACE TEMP TABLE truth_missing AS
SELECT from_id AS publication_id, to_id AS take_id
FROM truth_link AS l
ANTI JOIN verdict AS v ON l.kind = v.kind AND l.from_id = v.from_id AND l.to_id = v.to_id
WHERE l.kind = 'transport' AND l.is_decided AND l.needs = 'derive.link_transport_nearest';

-- Each message and subscription of its topic, on the clock of the subscription: when it could be
-- taken at the earliest (NULL: the trace does not tell how far the clocks are apart); since when
-- nothing of its publisher was; and when a later message of its publisher was, as the trace tells.
-- An address may have been that of several subscriptions: `life` says the how manieth had it.
CREATE OR REPLACE TEMP TABLE truth_pair AS
WITH life AS (
    SELECT
        subscription_id, host, pid, subscription_handle, created_ns,
        row_number() OVER (
            PARTITION BY host, pid, subscription_handle ORDER BY created_ns
        ) AS life
    FROM simulated_subscription
),
sent AS (
    SELECT
        publication_id, host, pid, publisher_handle, least(intra_ns, rcl_ns, rmw_ns) AS sent_ns
    FROM simulated_publication
),
pair AS (
    SELECT publication_id, subscription_id FROM simulated_undelivered
    UNION
    SELECT publication_id, subscription_id FROM simulated_take WHERE publication_id IS NOT NULL
),
-- What was taken, as far as the trace tells which message it was; a copy of a message in a buffer
-- does not count.
taken AS (
    SELECT
        t.subscription_id, s.host, s.pid, s.publisher_handle, s.sent_ns,
        min(coalesce(t.dequeue_ns, t.rmw_ns)) AS taken_ns
    FROM truth_link AS l
    JOIN simulated_take AS t ON l.to_id = t.take_id::VARCHAR
    JOIN sent AS s ON l.from_id = s.publication_id::VARCHAR
    WHERE l.kind = 'transport' AND l.is_decided
        AND t.take_id NOT IN (FROM truth_copy)
        AND l.to_id NOT IN (SELECT take_id FROM truth_missing)
    GROUP BY ALL
),
earliest AS (
    SELECT subscription_id, host, pid, publisher_handle, min(sent_ns) AS sent_ns
    FROM taken
    GROUP BY ALL
),
-- How the clocks of two hosts are apart, and how long messages are on their way, where the trace
-- tells it.
way AS (
    SELECT
        t.publication_host, t.take_host,
        quantile_disc(t.take_rmw_ns - t.publication_rmw_ns - t.latency_ns, 0.5) AS apart_ns,
        max(t.latency_ns) AS longest_ns
    FROM truth_link AS l
    JOIN simulated_transport AS t
        ON l.from_id = t.publication_id::VARCHAR AND l.to_id = t.take_id::VARCHAR
    WHERE l.kind = 'transport' AND l.is_decided
    GROUP BY ALL
)
SELECT
    a.publication_id, a.subscription_id, s.host, s.pid, s.subscription_handle, s.life,
    s.created_ns, p.host <> s.host AS has_two_clocks, w.longest_ns,
    p.sent_ns + CASE WHEN p.host = s.host THEN 0 ELSE w.apart_ns END AS arrival_ns,
    CASE
        WHEN f.sent_ns < p.sent_ns
            THEN p.sent_ns + CASE WHEN p.host = s.host THEN 0 ELSE w.apart_ns END
        ELSE s.created_ns
    END AS since_ns,
    coalesce(n.taken_ns, 9223372036854775807) AS until_ns,
    f.sent_ns < p.sent_ns AS has_earlier,
    n.taken_ns IS NOT NULL AS has_later
FROM pair AS a
JOIN sent AS p ON a.publication_id = p.publication_id
JOIN life AS s ON a.subscription_id = s.subscription_id
LEFT JOIN earliest AS f
    ON a.subscription_id = f.subscription_id AND p.host = f.host AND p.pid = f.pid
    AND p.publisher_handle IS NOT DISTINCT FROM f.publisher_handle
LEFT JOIN way AS w ON p.host = w.publication_host AND s.host = w.take_host
ASOF LEFT JOIN taken AS n
    ON a.subscription_id = n.subscription_id AND p.host = n.host AND p.pid = n.pid
    AND coalesce(p.publisher_handle, 0) = coalesce(n.publisher_handle, 0)
    AND p.sent_ns < n.sent_ns;

-- Pairs whose fate the trace may not show, and why: nothing joins the clocks of the two hosts; the
-- take may be in a hole; only a hole shows whether the two knew each other; or the take may be one
-- of those whose message the trace does not show. Where nothing later was taken, every hole behind
-- may hide the take (`hidden`: only such holes).
CREATE OR REPLACE TEMP TABLE truth_excuse AS
WITH unidentified AS (
    SELECT t.subscription_id, coalesce(t.dequeue_ns, t.rmw_ns) AS taken_ns
    FROM truth_link AS l
    JOIN simulated_take AS t ON l.to_id = t.take_id::VARCHAR
    JOIN truth_link AS r ON r.kind = 'take' AND l.to_id = r.to_id
    WHERE l.kind = 'transport'
        AND (NOT l.is_decided OR l.to_id IN (SELECT take_id FROM truth_missing))
        AND (
            r.is_decided
            OR (
                SELECT CASE t.method WHEN 'ring_buffer' THEN NOT has_dequeue ELSE NOT has_take END
                FROM truth_layout
            )
        )
)
SELECT
    p.publication_id, p.subscription_id,
    CASE
        WHEN bool_or(p.arrival_ns IS NULL OR h.end_ns > p.arrival_ns) FILTER (h.host IS NOT NULL)
            THEN CASE
                WHEN bool_or(p.has_later) THEN 'events are missing'
                ELSE 'nothing later taken'
            END
    END AS hidden,
    CASE
        WHEN bool_or(p.arrival_ns IS NULL) THEN 'clocks are apart'
        WHEN bool_or(h.host IS NOT NULL) AND bool_or(p.has_later) THEN 'events are missing'
        WHEN (p.subscription_id, p.publication_id) IN (
            SELECT (a.subscription_id, a.publication_id)
            FROM truth_pair AS a
            JOIN unidentified AS u
                ON a.subscription_id = u.subscription_id
                AND u.taken_ns BETWEEN a.arrival_ns AND a.until_ns
        ) THEN 'takes of unknown messages'
        WHEN bool_or(h.host IS NOT NULL) THEN 'nothing later taken'
    END AS unclear
FROM truth_pair AS p
LEFT JOIN truth_hole AS h
    ON p.host = h.host AND coalesce(p.pid = h.pid, true)
    AND h.begin_ns < p.until_ns AND h.end_ns > p.since_ns
GROUP BY p.publication_id, p.subscription_id;

-- Messages that a subscription did not take, where the publication is in the trace. `undecided`
-- says why the trace does not decide the reason even if nothing of it is missing, NULL where it
-- does. A trace shows what was taken, and of everything else only what follows from that: when the
-- two were connected shows by the first message that was taken, that a message is not merely late
-- by one after it.
CREATE OR REPLACE TEMP TABLE truth_drop AS
WITH
-- Subscriptions that ended before others of their process.
outlived AS (
    SELECT DISTINCT s.subscription_id
    FROM simulated_subscription AS s
    JOIN simulated_subscription AS o
        ON s.host = o.host AND s.pid = o.pid AND o.created_ns <= s.ended_ns
        AND (o.ended_ns IS NULL OR o.ended_ns > s.ended_ns)
),
of_any AS (
    SELECT t.subscription_id, max(p.source_timestamp_ns) AS last_stamp_ns
    FROM truth_link AS l
    JOIN simulated_take AS t ON l.to_id = t.take_id::VARCHAR
    JOIN simulated_publication AS p ON l.from_id = p.publication_id::VARCHAR
    WHERE l.kind = 'transport' AND l.is_decided
    GROUP BY ALL
),
unnamed AS (
    SELECT DISTINCT host, pid FROM simulated_unrecorded WHERE event LIKE '%\_init' ESCAPE '\'
),
-- What came through a ring buffer.
buffered AS (
    SELECT DISTINCT (t.subscription_id, p.host, p.pid, p.publisher_handle)
    FROM simulated_take AS t
    JOIN simulated_publication AS p ON t.publication_id = p.publication_id
    WHERE t.method = 'ring_buffer'
),
-- Publications without any event that names the publisher.
nameless AS (
    SELECT p.publication_id
    FROM simulated_publication AS p
    CROSS JOIN (
        SELECT count(*) > 0 AS is_named_by_rmw
        FROM simulated_declared
        WHERE event = 'ros2:rmw_publish' AND field LIKE '%publisher_handle'
    )
    CROSS JOIN LATERAL unnest(
        [p.intra_ns, p.rcl_ns, CASE WHEN is_named_by_rmw THEN p.rmw_ns END]
    ) AS n(ts_ns)
    LEFT JOIN simulated_unrecorded AS r
        ON p.host = r.host AND p.pid = r.pid AND p.tid = r.tid AND n.ts_ns = r.ts_ns
    WHERE n.ts_ns IS NOT NULL
    GROUP BY p.publication_id
    HAVING bool_and(r.ts_ns IS NOT NULL)
)
SELECT
    u.publication_id::VARCHAR AS publication_id, s.host, s.pid, s.subscription_handle, s.life,
    u.reason, u.is_internal, x.hidden, x.unclear,
    coalesce(s.has_earlier, false) AS has_earlier, s.has_later,
    CASE
        WHEN (p.host, p.pid) IN (SELECT (host, pid) FROM unnamed)
            OR (s.host, s.pid) IN (SELECT (host, pid) FROM unnamed)
            THEN 'initialisation is missing'
        WHEN u.publication_id IN (FROM nameless) THEN 'nothing names its publisher'
        WHEN u.publication_id IN (FROM truth_equal_stamp) THEN 'another message has its stamp'
        WHEN u.reason = 'before_subscription' THEN CASE
            WHEN s.has_two_clocks AND (s.arrival_ns + s.longest_ns >= s.created_ns) IS NOT FALSE
                THEN 'clocks are apart'
            WHEN NOT s.has_two_clocks AND w.ts_ns >= s.created_ns THEN 'created meanwhile'
        END
        WHEN u.reason = 'overwritten' THEN CASE
            WHEN (u.subscription_id, p.host, p.pid, p.publisher_handle) IN (FROM buffered)
                AND (SELECT NOT has_dequeue FROM truth_layout)
                THEN 'no event of ring buffers'
            WHEN a.last_stamp_ns > p.source_timestamp_ns IS NOT TRUE THEN 'nothing later taken'
            WHEN s.has_earlier IS NOT TRUE THEN 'nothing earlier taken'
        END
        WHEN u.reason IN ('lost_in_transport', 'take_failed') THEN CASE
            WHEN NOT s.has_later THEN 'nothing later taken'
            WHEN s.has_earlier IS NOT TRUE THEN 'nothing earlier taken'
        END
        WHEN u.reason = 'before_discovery' THEN CASE
            WHEN NOT s.has_later THEN 'nothing later taken'
        END
        WHEN u.reason = 'expired' THEN 'no event of expiry'
        -- That its process ends shows.
        WHEN u.reason = 'subscription_ended' THEN CASE
            WHEN s.subscription_id IN (FROM outlived)
                THEN 'no event of destruction'
        END
        ELSE 'trace ends'
    END AS undecided
FROM simulated_undelivered AS u
JOIN simulated_publication AS p ON u.publication_id = p.publication_id
JOIN truth_pair AS s
    ON u.publication_id = s.publication_id AND u.subscription_id = s.subscription_id
JOIN truth_excuse AS x
    ON u.publication_id = x.publication_id AND u.subscription_id = x.subscription_id
JOIN truth_link AS l ON l.kind = 'publication' AND u.publication_id::VARCHAR = l.from_id
LEFT JOIN of_any AS a ON u.subscription_id = a.subscription_id
LEFT JOIN (
    SELECT publication_id, max(ts_ns) AS ts_ns FROM simulated_dds_event GROUP BY publication_id
) AS w ON u.publication_id = w.publication_id
WHERE l.is_decided;

-- Processes for which the trace does not show which subscription had a handle.
CREATE OR REPLACE TEMP TABLE truth_mixed AS
SELECT DISTINCT host, pid
FROM simulated_subscription
SEMI JOIN (
    SELECT host, pid FROM simulated_unrecorded WHERE event LIKE '%\_init' ESCAPE '\'
) AS u USING (host, pid)
GROUP BY host, pid, subscription_handle
HAVING count(*) > 1;

-- Messages that a subscription did take, and why the event of that is not in the trace, if it is
-- not. Copies of messages that come through a ring buffer as well are no deliveries.
CREATE OR REPLACE TEMP TABLE truth_delivery AS
SELECT
    t.publication_id::VARCHAR AS publication_id, s.host, s.pid, s.subscription_handle, s.life,
    coalesce(any_value(u.cause), 'recorded') AS cause,
    any_value(x.hidden) AS hidden,
    any_value(x.unclear) AS unclear,
    bool_or(coalesce(l.is_decided, false)) AS is_decided,
    bool_or(t.take_id::VARCHAR IN (SELECT take_id FROM truth_missing)) AS is_missing,
    bool_or((u.host, u.cpu) IN (SELECT (host, cpu) FROM truth_unseen_cpu)) AS is_unseen,
    bool_or(t.publication_id IN (FROM truth_equal_stamp)) AS is_twin,
    bool_or(coalesce(t.dequeue_ns, t.rmw_ns) > e.ts_ns) AS is_behind_all
FROM simulated_take AS t
LEFT JOIN (
    SELECT host, max(ts_ns) AS ts_ns FROM truth_recorded GROUP BY host
) AS e ON t.host = e.host
JOIN truth_pair AS s
    ON t.publication_id = s.publication_id AND t.subscription_id = s.subscription_id
JOIN truth_excuse AS x
    ON t.publication_id = x.publication_id AND t.subscription_id = x.subscription_id
LEFT JOIN truth_link AS l ON l.kind = 'transport' AND t.take_id::VARCHAR = l.to_id
LEFT JOIN simulated_unrecorded AS u
    ON t.host = u.host AND t.pid = u.pid AND t.tid = u.tid
    AND u.ts_ns = coalesce(t.dequeue_ns, t.rmw_ns)
WHERE t.take_id NOT IN (FROM truth_copy)
GROUP BY ALL;

-- What became of the events that would tell each take its publication. Where some process that
-- publishes on the topic was not recorded when the message was sent, and another one was, either may
-- have sent it; so may any, where initialisation is missing, which alone tells who publishes what.
CREATE OR REPLACE TEMP TABLE truth_origin AS
WITH layout AS (
    SELECT
        coalesce(bool_or(event = 'dds:write' AND field = 'timestamp'), false)
        AND NOT coalesce(bool_or(event = 'ros2:rmw_publish' AND field = 'timestamp'), false)
            AS is_dds_stamped
    FROM simulated_declared
),
written AS (
    SELECT publication_id, max(ts_ns) AS ts_ns
    FROM simulated_dds_event
    WHERE event = 'dds:write'
    GROUP BY publication_id
),
-- How far stamps are from the clock of the trace, at least and at most.
shift AS (
    SELECT
        host, min(source_timestamp_ns - rmw_ns) AS shift_ns,
        max(source_timestamp_ns - rmw_ns) AS greatest_shift_ns
    FROM simulated_publication
    GROUP BY host
),
-- Some ways to publish have no events, such as loaned and serialised messages of older releases.
sent AS (
    SELECT
        p.publication_id, p.topic_name, p.host, p.pid, p.tid, p.intra_ns, p.source_timestamp_ns,
        coalesce(p.intra_ns, p.rclcpp_ns, p.rcl_ns, p.rmw_ns) IS NULL
        AND p.publication_id NOT IN (SELECT publication_id FROM simulated_dds_event)
            AS has_no_event,
        coalesce(
            CASE WHEN l.is_dds_stamped THEN w.ts_ns ELSE p.rmw_ns END,
            p.source_timestamp_ns - h.shift_ns
        ) AS stamped_ns
    FROM simulated_publication AS p
    CROSS JOIN layout AS l
    LEFT JOIN written AS w ON p.publication_id = w.publication_id
    LEFT JOIN shift AS h ON p.host = h.host
),
sender AS (
    SELECT DISTINCT topic_name, host, pid FROM simulated_publication
),
shared_topic AS (
    SELECT topic_name FROM sender GROUP BY topic_name HAVING count(*) > 1
),
unnamed AS (
    SELECT DISTINCT host, pid FROM simulated_unrecorded WHERE event LIKE '%\_init' ESCAPE '\'
),
absent AS (
    SELECT DISTINCT s.publication_id
    FROM sent AS s
    JOIN truth_hole AS h
        ON s.host = h.host AND s.pid = h.pid AND h.cpu IS NULL
        AND s.stamped_ns BETWEEN h.begin_ns AND h.end_ns
    WHERE s.topic_name IN (FROM shared_topic)
        OR EXISTS (FROM unnamed)
),
-- Stamped while events of a host were lost that publishes on the topic, or may do so: what says who
-- sent it may be missing.
possible AS (
    SELECT DISTINCT
        s.publication_id, o.host,
        s.source_timestamp_ns - h.greatest_shift_ns AS earliest_ns,
        s.source_timestamp_ns - h.shift_ns AS latest_ns
    FROM sent AS s
    JOIN (
        SELECT topic_name, host FROM sender
        UNION
        SELECT NULL, host FROM unnamed
    ) AS o ON s.topic_name = coalesce(o.topic_name, s.topic_name)
    JOIN shift AS h ON o.host = h.host
),
beside_hole AS (
    SELECT t.take_id
    FROM simulated_take AS t
    JOIN possible AS s ON t.publication_id = s.publication_id
    -- The stamp is of another clock than the hole.
    JOIN truth_hole AS h
        ON s.host = h.host
        AND s.latest_ns + 1_000_000 > h.begin_ns AND s.earliest_ns - 1_000_000 < h.end_ns
),
taken_beside_hole AS (
    SELECT t.id::BIGINT AS take_id
    FROM (FROM truth_time WHERE kind = 'take') AS t
    JOIN truth_hole AS h
        ON t.host = h.host AND coalesce(t.pid = h.pid, true)
        AND t.ts_ns + 1_000_000 > h.begin_ns AND t.ts_ns - 1_000_000 < h.end_ns
),
-- Since when there is an event of each process whose initialisation is missing: before, it may have
-- been there and have sent anything.
silent AS (
    SELECT host, pid, min(ts_ns) AS until_ns
    FROM truth_recorded
    SEMI JOIN unnamed USING (host, pid)
    GROUP BY host, pid
),
decided AS (
    SELECT to_id, bool_or(is_decided) AS is_decided
    FROM truth_link
    WHERE kind = 'transport'
    GROUP BY to_id
),
hidden AS (
    SELECT DISTINCT t.take_id
    FROM simulated_take AS t
    JOIN sent AS s ON t.publication_id = s.publication_id
    JOIN truth_hole AS h
        ON t.host = h.host AND coalesce(t.pid = h.pid, true)
        AND s.intra_ns < h.end_ns AND t.dequeue_ns > h.begin_ns
    WHERE t.method = 'ring_buffer'
)
SELECT
    t.take_id::VARCHAR AS take_id,
    CASE
        WHEN CASE t.method
                WHEN 'callback_only' THEN true
                WHEN 'ring_buffer' THEN NOT y.has_dequeue
                ELSE NOT y.has_take
            END
            THEN 'no event'
        WHEN s.has_no_event THEN 'sent, no event'
        WHEN x.is_replay AND t.method = 'ring_buffer' THEN 'kept'
        WHEN k.cause IS NOT NULL THEN concat('taken, ', k.cause)
        WHEN u.cause IS NOT NULL THEN concat('sent, ', u.cause)
        ELSE 'recorded'
    END AS truth,
    k.cause IS NULL AND u.cause IS NULL AND t.method <> 'callback_only' AND NOT d.is_decided
        AS is_undecided,
    t.take_id IN (FROM hidden) AS is_in_hole,
    t.take_id IN (FROM beside_hole) AS is_beside_hole,
    t.take_id IN (FROM taken_beside_hole) AS is_taken_beside_hole,
    (t.host, t.pid) IN (FROM unnamed) AS is_unnamed,
    s.stamped_ns < (SELECT max(until_ns) FROM silent) AS has_silent,
    t.publication_id IN (FROM absent) AS has_absent,
    k.cause IS NOT NULL AS is_torn,
    (u.host, u.cpu) IN (SELECT (host, cpu) FROM truth_unseen_cpu) AS is_unseen,
    t.publication_id IN (FROM truth_equal_stamp) AS is_twin,
    t.take_id::VARCHAR IN (SELECT take_id FROM truth_missing) AS is_missing
FROM simulated_take AS t
CROSS JOIN truth_layout AS y
JOIN simulated_transport AS x ON t.take_id = x.take_id
JOIN sent AS s ON t.publication_id = s.publication_id
LEFT JOIN decided AS d ON t.take_id::VARCHAR = d.to_id
LEFT JOIN simulated_unrecorded AS k
    ON t.host = k.host AND t.pid = k.pid AND t.tid = k.tid
    AND k.ts_ns = coalesce(t.dequeue_ns, t.rmw_ns)
    AND k.event IN ('ros2:rmw_take', 'ros2:rclcpp_ring_buffer_dequeue')
LEFT JOIN simulated_unrecorded AS u
    ON s.host = u.host AND s.pid = u.pid AND s.tid = u.tid
    AND u.ts_ns = CASE WHEN t.method = 'ring_buffer' THEN s.intra_ns ELSE s.stamped_ns END
    AND u.event IN ('ros2:rmw_publish', 'dds:write', 'ros2:rclcpp_intra_publish');
