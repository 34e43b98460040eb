-- description: The number of each take, in the order in which they began, the callback that it led
--     to, and its subscription, by the event that initialised that: as the take, or else the
--     callback knows it. A subscription callback that ran without any take traced was handed its
--     message all the same: then both are the same. Where nothing tells the subscription, it may be
--     a placeholder (`is_inferred`).
-- grain: one row per message handed over to a subscription
-- when: staging.take_chain, staging.callback_binding

-- Takes that come in batches: an executor such as that of r2r takes a message of every subscription
-- that has one, and calls their callbacks only then. A callback_start of a known subscription that
-- follows no take of it has the oldest take of that subscription on its thread that no callback was
-- called with yet. No event of another executor lies between, and no gap.
-- when: staging.callback_binding WHERE take_event_id IS NULL AND NOT is_intra_process AND kind =
--     'subscription' AND subscription_event_id IS NOT NULL
-- columns: start_event_id BIGINT, take_event_id BIGINT
CREATE OR REPLACE TEMP TABLE callback_batch AS
WITH begun AS (
    SELECT
        b.start_event_id AS event_id,
        r.thread_id, b.subscription_event_id, r.previous_executor_event_id
    FROM staging.callback_binding AS b
    JOIN staging.callback_run AS r ON b.start_event_id = r.start_event_id
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
        t.start_event_id AS event_id,
        t.thread_id, t.subscription_event_id,
        NULL::BIGINT AS previous_executor_event_id,
        true AS is_take
    FROM staging.take_chain AS t
    SEMI JOIN begun AS b
        ON t.thread_id = b.thread_id AND t.subscription_event_id = b.subscription_event_id
    ANTI JOIN staging.callback_binding AS c ON t.start_event_id = c.take_event_id
    WHERE t.method <> 'ring_buffer'
    UNION ALL
    SELECT event_id, thread_id, subscription_event_id, previous_executor_event_id, false FROM begun
),
unbroken AS (
    SELECT
        s.*,
        coalesce(k.resumed_event_id, 0) AS since_event_id
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
SELECT
    c.event_id AS start_event_id,
    t.event_id AS take_event_id
FROM numbered AS c
JOIN numbered AS t
    ON c.thread_id = t.thread_id
    AND c.subscription_event_id = t.subscription_event_id
    AND c.since_event_id = t.since_event_id
    AND c.number = t.number
WHERE NOT c.is_take AND t.is_take AND coalesce(c.previous_executor_event_id < t.event_id, true)
QUALIFY row_number() OVER (PARTITION BY t.event_id ORDER BY c.event_id) = 1;

-- Subscriptions of ring buffers whose initialisation was not traced: what is taken out of a buffer
-- is for the callback that directly follows. One callback is one subscription, which may be known;
-- else it is a placeholder by the first dequeue. Where several callbacks follow on one buffer, or
-- one on several, the owner is not known (NULL).
-- when: staging.take_chain WHERE method = 'ring_buffer' AND NOT is_known
-- columns: process_id BIGINT, buffer_handle UBIGINT, subscription_event_id BIGINT, is_inferred
--     BOOLEAN
CREATE OR REPLACE TEMP TABLE buffer_owner AS
WITH dequeue AS (
    SELECT t.start_event_id, t.process_id, t.buffer_handle
    FROM staging.take_chain AS t
    WHERE t.method = 'ring_buffer' AND NOT t.is_known
),
used AS (
    SELECT DISTINCT
        d.process_id, d.buffer_handle, b.callback_event_id, b.subscription_event_id
    FROM dequeue AS d
    JOIN staging.callback_binding AS b ON d.start_event_id = b.take_event_id
),
reader AS (
    SELECT
        process_id, buffer_handle,
        count(*) AS callback_count,
        count(subscription_event_id) AS known_count,
        count(DISTINCT subscription_event_id) AS subscription_count,
        min(subscription_event_id) AS subscription_event_id,
        max(buffer_count) AS buffer_count
    FROM (
        SELECT
            *,
            count(*) OVER (PARTITION BY callback_event_id) AS buffer_count
        FROM used
    )
    GROUP BY process_id, buffer_handle
),
buffer AS (
    SELECT
        process_id, buffer_handle,
        min(start_event_id) AS event_id
    FROM dequeue
    GROUP BY process_id, buffer_handle
)
SELECT
    b.process_id, b.buffer_handle,
    CASE
        WHEN r.subscription_count = 1 AND r.known_count = r.callback_count
            THEN r.subscription_event_id
        WHEN coalesce(r.callback_count = 1 AND r.buffer_count = 1, true) THEN b.event_id
    END AS subscription_event_id,
    coalesce(r.known_count = 0, true) AS is_inferred
FROM buffer AS b
LEFT JOIN reader AS r ON b.process_id = r.process_id AND b.buffer_handle = r.buffer_handle;

-- The subscription of messages that did not come through the middleware, where its initialisation
-- was not traced: that of the ring buffer, else of the callback that was handed the message without
-- a traced take. A callback that none was traced for is a subscription of its own, a placeholder by
-- its first instance.
-- when: buffer_owner, staging.callback_binding WHERE take_event_id IS NULL AND
--     subscription_event_id IS NULL AND (kind = 'subscription' OR (is_intra_process AND
--     kind = 'unknown'))
-- columns: start_event_id BIGINT, process_id BIGINT, subscription_event_id BIGINT, is_inferred
--     BOOLEAN
CREATE OR REPLACE TEMP TABLE take_inferred AS
WITH handed_over AS (
    SELECT start_event_id, process_id, callback_event_id
    FROM staging.callback_binding
    WHERE take_event_id IS NULL
        AND subscription_event_id IS NULL
        AND (kind = 'subscription' OR (is_intra_process AND kind = 'unknown'))
),
dequeue AS (
    SELECT t.start_event_id, t.process_id, o.subscription_event_id, o.is_inferred
    FROM staging.take_chain AS t
    JOIN buffer_owner AS o
        ON t.process_id = o.process_id AND t.buffer_handle = o.buffer_handle
    WHERE t.method = 'ring_buffer' AND NOT t.is_known AND o.subscription_event_id IS NOT NULL
),
callback AS (
    SELECT
        callback_event_id,
        min(start_event_id) AS event_id
    FROM handed_over
    GROUP BY callback_event_id
),
handed AS (
    SELECT
        b.callback_event_id,
        CASE WHEN bool_and(d.start_event_id IS NOT NULL) THEN min(d.subscription_event_id) END
            AS subscription_event_id,
        bool_and(d.is_inferred) AS is_inferred
    FROM staging.callback_binding AS b
    SEMI JOIN callback AS c ON b.callback_event_id = c.callback_event_id
    LEFT JOIN dequeue AS d ON b.take_event_id = d.start_event_id
    WHERE b.take_event_id IS NOT NULL
    GROUP BY b.callback_event_id
)
SELECT start_event_id, process_id, subscription_event_id, is_inferred FROM dequeue
UNION ALL
SELECT
    l.start_event_id, l.process_id,
    CASE WHEN h.callback_event_id IS NULL THEN c.event_id ELSE h.subscription_event_id END,
    coalesce(h.is_inferred, true)
FROM handed_over AS l
JOIN callback AS c ON l.callback_event_id = c.callback_event_id
LEFT JOIN handed AS h ON l.callback_event_id = h.callback_event_id
WHERE h.callback_event_id IS NULL OR h.subscription_event_id IS NOT NULL;

WITH run AS (
    SELECT
        b.start_event_id, b.process_id, b.kind, b.is_intra_process, b.subscription_event_id,
        coalesce(b.take_event_id, h.take_event_id) AS take_event_id
    FROM staging.callback_binding AS b
    LEFT JOIN callback_batch AS h ON b.start_event_id = h.start_event_id
),
every_take AS (
    SELECT
        c.start_event_id, c.process_id, c.rmw_handle, c.subscription_event_id,
        b.start_event_id AS callback_start_event_id,
        b.subscription_event_id AS callback_subscription_event_id
    FROM staging.take_chain AS c
    LEFT JOIN run AS b ON c.start_event_id = b.take_event_id
    UNION ALL
    SELECT start_event_id, process_id, NULL, NULL, start_event_id, subscription_event_id
    FROM run
    WHERE take_event_id IS NULL AND (kind = 'subscription' OR is_intra_process)
)
SELECT
    t.start_event_id, t.process_id, t.rmw_handle, t.callback_start_event_id,
    coalesce(
        t.subscription_event_id, i.subscription_event_id, t.callback_subscription_event_id
    ) AS subscription_event_id,
    coalesce(i.is_inferred, false) AS is_inferred,
    row_number() OVER (ORDER BY t.start_event_id) AS take_id
FROM every_take AS t
LEFT JOIN take_inferred AS i ON t.start_event_id = i.start_event_id
