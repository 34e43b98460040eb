-- Reasons that `stat_delivery` gives for messages that were not taken, beside those of the truth.
-- Compared row by row; the reasons that are right for each true one are in `accepted`.
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
        -- That a message has expired does not show.
        ('expired', 'lost_in_transport'),
        ('expired', 'not_delivered'),
        ('expired', 'take_failed'),
        ('subscription_ended', 'subscription_ended'),
        ('pending_at_end', 'pending_at_end'),
        ('pending_at_end', 'subscription_ended')
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
)
SELECT
    d.reason AS truth,
    coalesce(v.reason, v.status, 'no row') AS reason,
    d.undecided,
    count(*) AS messages,
    coalesce(bool_or(a.reason IS NOT NULL), false) AS is_right
FROM truth_drop AS d
JOIN publication AS b ON d.publication_id = b.true_id
JOIN place AS s
    ON d.host = s.host AND d.pid = s.pid AND d.subscription_handle = s.subscription_handle
    AND d.life = s.life
LEFT JOIN analysed.main.stat_delivery AS v
    ON b.publication_id = v.publication_id AND s.subscription_id = v.subscription_id
LEFT JOIN accepted AS a ON d.reason = a.truth AND v.reason = a.reason
GROUP BY ALL
ORDER BY ALL;
