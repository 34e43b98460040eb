-- title: A callback that never ends
-- description: Nothing else of its executor, or of its callback group, runs any more.
-- grain: one row per thread
-- reads: hanging_call
-- next: query service-latency --node {node}
SELECT
    0 AS place,
    node, callback, function,
    open_ns // 2 AS harm_ns,
    service_name,
    -- Only itself keeps the answer from being taken, or the request.
    is_answered OR is_own AS is_supposed,
    CASE
        WHEN is_answered THEN 'untaken'
        WHEN is_own THEN 'own'
    END AS reason,
    [node || callback, node || ' requests', node || ' waits'] AS claims
FROM hanging_call
