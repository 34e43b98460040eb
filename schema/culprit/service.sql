-- title: A service that a callback waits for
-- description: Its executor can run nothing else while a callback waits, and no callback of its
--     group while a coroutine awaits. Of several services the one that takes longest stands for
--     all, but of a coroutine one that is answered before it publishes.
-- grain: one row per node and callback that waits for services most of its time
-- reads: breakdown, callback_call, harm
-- next: query service-latency --node {node}
SELECT
    2 AS place,
    h.node, h.callback, h.function, h.path, h.topic_name, h.harm_ns, h.p95_ns, h.lost, h.published,
    q.p95_ns AS run_ns,
    q.usual_ns, q.long_calls,
    q.calls AS count,
    -- While a coroutine awaits, nodes go on.
    CASE WHEN NOT q.is_awaited OR h.waiting_node = h.node THEN h.waiting_node END AS waiting_node,
    CASE WHEN NOT q.is_awaited OR h.waiting_node = h.node THEN h.waiting_callback END
        AS waiting_callback,
    q.server AS other,
    q.server_callback AS other_callback,
    q.server_function AS other_function,
    q.service_name, q.is_awaited,
    NOT q.is_recorded AS is_supposed,
    [h.node || h.callback, q.server || q.server_callback, h.node || ' waits'] AS claims
FROM harm AS h
JOIN callback_call AS q ON h.node = q.node AND h.callback = q.callback
WHERE h.matters AND q.share > 0.5
    AND (
        NOT q.is_awaited
        OR h.own_ns > h.direct_ns
        OR q.usual_ns <= (
            SELECT max(b.max_ns)
            FROM breakdown AS b
            WHERE b.path = h.path AND b.node = h.node AND b.what = h.callback
                AND b.part = 'callback'
        )
    )
QUALIFY row_number() OVER (
    PARTITION BY h.node, h.callback ORDER BY q.total_ns DESC, q.service_name
) = 1
UNION ALL BY NAME
-- Its response leads on in a callback of its own: no callback waits meanwhile.
SELECT
    2 AS place,
    c.*,
    string_split(c.path, ' → ')[
        list_position(string_split(c.path, ' → '), printf('(%s)', s.service_name)) - 1
    ] AS other,
    s.service_name
FROM long_callback AS c
JOIN (
    SELECT DISTINCT
        service_name,
        printf('Service(%s)', service_name) AS callback
    FROM main.service
    WHERE list_contains($runs, run_id)
) AS s
    ON c.callback = s.callback AND contains(c.path, printf('(%s)', s.service_name))
