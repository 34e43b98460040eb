-- Reasons that `stat_delivery` gives for messages that were not taken, beside those of the truth.
-- Compared row by row; the reasons that are right for each true one are in `accepted`. Where events
-- are missing that the trace may need, saying that it cannot be told is no mistake; any other
-- reason has to be the true one all the same. So it is for messages that were taken, but whose take
-- is not in the trace: their truth is 'delivered', with the cause for which it is not.
WITH accepted AS (
    FROM (VALUES
        ('before_subscription', 'before_subscription'),
        ('before_discovery', 'before_discovery'),
        ('before_discovery', 'before_subscription'),
        ('lost_in_transport', 'lost_in_transport'),
        ('lost_in_transport', 'not_delivered'),
        ('overwritten', 'overwritten'),
        ('take_failed', 'take_failed'),
        -- A take that failed meanwhile goes before these.
        ('lost_in_transport', 'take_failed'),
        ('overwritten', 'take_failed'),
        ('before_discovery', 'take_failed'),
        -- That a message has expired does not show.
        ('expired', 'lost_in_transport'),
        ('expired', 'not_delivered'),
        ('expired', 'take_failed'),
        ('subscription_ended', 'subscription_ended'),
        -- Killed in a callback, or never back from it.
        ('subscription_ended', 'reader_in_callback'),
        ('pending_at_end', 'pending_at_end'),
        ('pending_at_end', 'subscription_ended'),
        ('pending_at_end', 'reader_in_callback'),
        ('delivered, late start', 'receiver_gap'),
        ('delivered, pause', 'receiver_gap'),
        ('delivered, loss', 'receiver_gap'),
        ('delivered, packets', 'receiver_gap'),
        ('delivered, truncation', 'receiver_gap'),
        -- Who leaves before others when recording stops is not told from who ends.
        ('delivered, stop', 'subscription_ended'),
        ('delivered, stop', 'pending_at_end'),
        ('delivered, stop', 'receiver_gap')
    ) AS a(truth, reason)
),
place AS (
    SELECT
        s.subscription_id, s.subscription_handle, h.hostname AS host, p.pid,
        row_number() OVER (
            PARTITION BY h.hostname, p.pid, s.subscription_handle ORDER BY s.created_ns
        ) AS life
    FROM analysed.store.subscription AS s
    JOIN analysed.store.process AS p ON s.process_id = p.process_id
    JOIN analysed.store.host AS h ON p.host_id = h.host_id
),
publication AS (
    SELECT found_from_id AS publication_id, from_id AS true_id
    FROM verdict
    WHERE kind = 'publication' AND from_id IS NOT NULL
),
-- A loss may tear a publication in two; the part that names no publisher has no row.
given AS (
    SELECT b.true_id, v.subscription_id, v.status, v.reason
    FROM publication AS b
    JOIN analysed.main.stat_delivery AS v ON b.publication_id = v.publication_id
),
said AS (
    SELECT
        d.reason AS truth,
        v.reason,
        coalesce(v.reason, v.status, 'no row') AS said,
        -- Nothing of the pair was taken; or nothing later.
        CASE v.reason
            WHEN 'never_taken' THEN NOT d.has_earlier AND NOT d.has_later
            WHEN 'no_longer_taken' THEN d.has_earlier AND NOT d.has_later
            ELSE false
        END AS is_so,
        CASE
            WHEN v.reason = 'receiver_gap' THEN d.hidden
            WHEN v.reason = 'unknown' AND d.unclear IS NOT NULL THEN d.unclear
            ELSE d.undecided
        END AS undecided
    FROM truth_drop AS d
    SEMI JOIN publication AS b ON d.publication_id = b.true_id
    JOIN place AS s
        ON d.host = s.host AND d.pid = s.pid AND d.subscription_handle = s.subscription_handle
        AND d.life = s.life
    LEFT JOIN given AS v
        ON d.publication_id = v.true_id AND s.subscription_id = v.subscription_id
    UNION ALL
    SELECT
        concat('delivered, ', t.cause),
        v.reason,
        v.reason,
        false,
        CASE
            WHEN t.is_missing THEN 'its link is missing'
            -- The take is there; what would tell its message is not.
            WHEN v.reason = 'unknown' AND NOT t.is_decided
                AND (t.unclear IS NOT NULL OR t.cause = 'recorded')
                THEN 'the link is not decided'
            -- Where a gap may hide the better partner, a message in a ring buffer has no link.
            WHEN v.reason = 'receiver_gap' AND NOT t.is_decided AND t.hidden IS NOT NULL
                THEN t.hidden
            -- Nor is a take that has no event, in a node without events of callbacks.
            WHEN v.reason IN ('pending_at_end', 'subscription_ended') AND NOT t.is_decided
                AND t.cause = 'recorded' AND (SELECT NOT has_take FROM truth_layout)
                THEN 'takes have no event'
            WHEN t.is_twin THEN 'another message has its stamp'
            WHEN t.is_unseen AND v.reason <> 'receiver_gap' THEN 'a stream is missing'
            -- A recording whose last part is missing ends before it.
            WHEN t.is_behind_all AND v.reason = 'pending_at_end' THEN 'nothing later is recorded'
            -- Objects whose handles were used again may be mixed up where one was not seen.
            WHEN (t.host, t.pid) IN (SELECT (host, pid) FROM truth_mixed) THEN
                'initialisation is missing'
        END
    FROM given AS v
    JOIN place AS s ON v.subscription_id = s.subscription_id
    JOIN truth_delivery AS t
        ON v.true_id = t.publication_id AND s.host = t.host AND s.pid = t.pid
        AND s.subscription_handle = t.subscription_handle AND s.life = t.life
    ANTI JOIN truth_drop AS d
        ON v.true_id = d.publication_id AND s.host = d.host AND s.pid = d.pid
        AND s.subscription_handle = d.subscription_handle AND s.life = d.life
    WHERE v.status <> 'delivered'
)
SELECT
    d.truth,
    d.said AS reason,
    d.undecided,
    count(*) AS messages,
    coalesce(bool_or(a.reason IS NOT NULL OR d.is_so), false) AS is_right
FROM said AS d
LEFT JOIN accepted AS a ON d.truth = a.truth AND d.reason = a.reason
GROUP BY d.truth, d.said, d.undecided, d.is_so
ORDER BY ALL;
