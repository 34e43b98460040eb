-- description: Takes that come in batches: an executor such as that of r2r takes a message of every
--     subscription that has one, and calls their callbacks only then. A callback_start of a known
--     subscription that follows no take of it has the oldest take of that subscription on its
--     thread that no callback was called with yet. No event of another executor lies between, and
--     no gap.
-- grain: one row per callback_start that has such a take
-- when: staging.callback_binding WHERE take_event_id IS NULL AND NOT is_intra_process
--     AND kind = 'subscription' AND subscription_event_id IS NOT NULL
WITH begun AS (
    SELECT
        b.start_event_id AS event_id, r.thread_id, b.subscription_event_id,
        r.previous_executor_event_id
    FROM staging.callback_binding AS b
    JOIN staging.callback_pair AS r ON b.start_event_id = r.start_event_id
    -- Beside messages from a buffer, copies come that no callback is called with.
    ANTI JOIN (FROM staging.callback_binding WHERE is_intra_process) AS i
        ON b.subscription_event_id = i.subscription_event_id
    WHERE b.take_event_id IS NULL
        AND NOT b.is_intra_process
        AND b.kind = 'subscription'
        AND b.subscription_event_id IS NOT NULL
),
step AS (
    SELECT
        t.start_event_id AS event_id, t.thread_id, t.subscription_event_id,
        NULL::BIGINT AS previous_executor_event_id, true AS is_take
    FROM staging.take_chain AS t
    SEMI JOIN begun AS b
        ON t.thread_id = b.thread_id AND t.subscription_event_id = b.subscription_event_id
    ANTI JOIN staging.callback_binding AS c ON t.start_event_id = c.take_event_id
    WHERE t.method <> 'ring_buffer'
    UNION ALL
    SELECT event_id, thread_id, subscription_event_id, previous_executor_event_id, false FROM begun
),
unbroken AS (
    SELECT s.*, coalesce(k.resumed_event_id, 0) AS since_event_id
    FROM step AS s
    ASOF LEFT JOIN staging.thread_break AS k
        ON s.thread_id = k.thread_id AND s.event_id >= k.resumed_event_id
),
counted AS (
    SELECT
        event_id, thread_id, subscription_event_id, since_event_id, previous_executor_event_id,
        is_take,
        sum(CASE WHEN is_take THEN 1 ELSE 0 END) OVER so_far AS take_count,
        sum(CASE WHEN is_take THEN 0 ELSE 1 END) OVER so_far AS start_count
    FROM unbroken
    WINDOW so_far AS (
        PARTITION BY thread_id, subscription_event_id, since_event_id
        ORDER BY event_id ROWS UNBOUNDED PRECEDING
    )
),
-- Callbacks for which no take was left do not count: they have the number of the one before.
numbered AS (
    SELECT
        *,
        CASE
            WHEN is_take THEN take_count
            ELSE start_count - greatest(
                0, max(start_count - take_count) OVER (
                    PARTITION BY thread_id, subscription_event_id, since_event_id
                    ORDER BY event_id ROWS UNBOUNDED PRECEDING
                )
            )
        END AS number
    FROM counted
)
SELECT c.event_id AS start_event_id, t.event_id AS take_event_id
FROM numbered AS c
JOIN numbered AS t
    ON c.thread_id = t.thread_id
    AND c.subscription_event_id = t.subscription_event_id
    AND c.since_event_id = t.since_event_id
    AND c.number = t.number
WHERE NOT c.is_take AND t.is_take AND coalesce(c.previous_executor_event_id < t.event_id, true)
QUALIFY row_number() OVER (PARTITION BY t.event_id ORDER BY c.event_id) = 1
