-- title: A service that a callback waits for
-- description: Its executor can run nothing else while a callback waits, and no callback of its
--     group while a coroutine awaits.
-- grain: one row per node and callback that waits for services most of its time
-- reads: callback_call, harm
-- next: query service-latency --node {node}
SELECT
    2 AS place,
    h.node, h.callback, h.function, h.path, h.topic_name, h.harm_ns, h.p95_ns, h.lost, h.published,
    q.p95_ns AS run_ns,
    q.usual_ns, q.long_calls,
    q.calls AS count,
    h.waiting_node, h.waiting_callback,
    q.server AS other,
    q.server_callback AS other_callback,
    q.server_function AS other_function,
    q.service_name, q.is_awaited,
    NOT q.is_recorded AS is_supposed,
    [h.node || h.callback, q.server || q.server_callback, h.node || ' waits'] AS claims
FROM harm AS h
JOIN callback_call AS q ON h.node = q.node AND h.callback = q.callback
WHERE h.matters AND q.share > 0.5
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
