-- description: What people call a callback: what triggers it, such as Timer(5 ms) or
--     Subscription(/scan), and the node that it belongs to. Timers of unknown period are
--     distinguished by their handles. Functions of Python have their names. Where several of a node
--     are triggered alike, the function of each follows.
-- grain: one row per callback object
-- column: callback_id, run_id
-- column: node VARCHAR  Full name of the node, or the name and pid of the process in brackets
-- column: label VARCHAR  What triggers it
-- column: is_internal
WITH triggered AS (
    SELECT
        c.callback_id, c.run_id, c.process_id, c.node_id, c.symbol,
        main.node_label(n.full_name, p.name, p.pid) AS node,
        CASE c.kind
            WHEN 'timer' THEN coalesce(
                printf('Timer(%.10g ms)', t.period_ns / 1e6),
                printf('Timer(0x%x)', t.timer_handle),
                'Timer(?)'
            )
            WHEN 'subscription' THEN printf('Subscription(%s)', coalesce(s.topic_name, '?'))
            WHEN 'service' THEN printf('Service(%s)', coalesce(v.service_name, '?'))
            WHEN 'action' THEN
                printf('Action(%s)', regexp_replace(v.service_name, '/_action/send_goal$', ''))
            WHEN 'function'
                THEN replace(regexp_replace(c.symbol, '^[^:]*:', ''), '.<locals>', '')
            ELSE printf('Callback(0x%x)', c.callback_handle)
        END AS label,
        -- A lambda has no name, but a place.
        CASE WHEN c.kind <> 'function' THEN coalesce(
            derive.function_name(c.symbol),
            regexp_extract(c.source, '[^/]+$'),
            'lambda' || nullif(regexp_extract(c.symbol, '\{lambda\(.*\)(#\d+)\}', 1), '')
        ) END AS function,
        coalesce(s.is_internal, v.is_internal, false) AS is_internal
    FROM store.callback AS c
    JOIN store.process AS p ON c.process_id = p.process_id
    LEFT JOIN store.node AS n ON c.node_id = n.node_id
    LEFT JOIN store.timer AS t ON c.timer_id = t.timer_id
    LEFT JOIN store.subscription AS s ON c.subscription_id = s.subscription_id
    LEFT JOIN store.service AS v ON c.service_id = v.service_id
)
SELECT
    callback_id, run_id, node,
    label || CASE
        WHEN min(function) OVER alike < max(function) OVER alike
            THEN coalesce(' ' || function, '')
        ELSE ''
    END
    AS label,
    is_internal
FROM triggered
WINDOW alike AS (PARTITION BY run_id, process_id, node_id, label)
