-- description: Callback objects with what they belong to. One whose creation was not traced learns
--     its subscription or service from the messages or requests that it was called with (the most
--     frequent), else what it belongs to from the executor. What goes on for a callback of Python
--     has the node of that.
-- grain: one row per callback object
-- when: staging.callback_object
WITH learned AS (
    SELECT
        b.callback_event_id,
        mode(t.subscription_id ORDER BY t.subscription_id) AS subscription_id
    FROM staging.callback_binding AS b
    JOIN staging.take_subscription AS t ON b.start_event_id = t.callback_start_event_id
    WHERE b.kind IN ('unknown', 'function', 'subscription')
    GROUP BY b.callback_event_id
),
asked AS (
    SELECT
        b.callback_event_id,
        mode(s.service_id ORDER BY s.service_id) AS service_id
    FROM staging.callback_binding AS b
    JOIN staging.service_event AS e ON b.request_event_id = e.event_id
    JOIN staging.service AS s ON e.service_event_id = s.event_id
    GROUP BY b.callback_event_id
),
owned AS (
    SELECT
        c.callback_id, c.event_id, c.process_id, c.callback_handle, c.symbol, c.created_ns,
        CASE WHEN c.kind = 'unknown' THEN coalesce(o.kind, c.kind) ELSE c.kind END AS kind,
        CASE WHEN o.kind = 'subscription' THEN o.owner_event_id ELSE c.subscription_event_id END
            AS subscription_event_id,
        CASE WHEN o.kind = 'timer' THEN o.owner_event_id ELSE c.timer_event_id END
            AS timer_event_id,
        CASE WHEN o.kind = 'service' THEN o.owner_event_id ELSE c.service_event_id END
            AS service_event_id
    FROM staging.callback_object AS c
    LEFT JOIN staging.callback_owner AS o ON c.event_id = o.callback_event_id
),
complete AS (
    SELECT
        c.callback_id, c.event_id, c.process_id, t.timer_id, c.callback_handle, c.symbol,
        c.created_ns,
        coalesce(s.subscription_id, l.subscription_id) AS subscription_id,
        coalesce(e.service_id, v.service_id) AS service_id,
        CASE
            WHEN c.kind NOT IN ('unknown', 'function') THEN c.kind
            WHEN l.subscription_id IS NOT NULL THEN 'subscription'
            WHEN v.service_id IS NOT NULL THEN 'service'
            ELSE c.kind
        END AS kind,
        coalesce(t.node_id, s.node_id, e.node_id) AS node_id
    FROM owned AS c
    LEFT JOIN staging.subscription AS s ON c.subscription_event_id = s.event_id
    LEFT JOIN staging.timer AS t ON c.timer_event_id = t.event_id
    LEFT JOIN staging.service AS e ON c.service_event_id = e.event_id
    LEFT JOIN learned AS l
        ON s.subscription_id IS NULL
        AND c.kind IN ('unknown', 'function', 'subscription')
        AND c.event_id = l.callback_event_id
    LEFT JOIN asked AS v
        ON e.service_id IS NULL
        AND c.kind IN ('unknown', 'function', 'service')
        AND c.event_id = v.callback_event_id
),
going_on AS (
    SELECT
        b.callback_event_id,
        mode(f.callback_event_id ORDER BY f.callback_event_id) AS first_event_id
    FROM staging.callback_binding AS b
    JOIN staging.callback_binding AS f ON b.call_event_id = f.start_event_id
    WHERE b.kind = 'function'
    GROUP BY b.callback_event_id
)
SELECT
    c.callback_id, c.process_id,
    coalesce(c.node_id, s.node_id, v.node_id, f.node_id) AS node_id,
    -- In Python the goal is executed there: the request is answered before.
    CASE
        WHEN c.kind = 'service' AND ends_with(v.service_name, '/_action/send_goal') THEN 'action'
        ELSE c.kind
    END AS kind,
    c.subscription_id, c.timer_id, c.service_id, c.callback_handle, c.symbol,
    p.source, c.created_ns, c.event_id
FROM complete AS c
LEFT JOIN (
    SELECT
        process_id, number,
        arg_max(text, event_id) AS source
    FROM staging.python_mark
    WHERE kind = 'source'
    GROUP BY process_id, number
) AS p
    ON c.process_id = p.process_id AND c.callback_handle = p.number
LEFT JOIN staging.subscription AS s ON c.subscription_id = s.subscription_id
LEFT JOIN staging.service AS v ON c.service_id = v.service_id
LEFT JOIN going_on AS g ON c.event_id = g.callback_event_id
LEFT JOIN complete AS f ON g.first_event_id = f.event_id
