-- title: A timer that uses old data
-- description: It comes half as often as what it uses, or seems to use (`open_end`), or less.
-- grain: one row per timer and path that ends at its node, or leads on
-- reads: application_path, breakdown, callback_use, noticed, open_end
-- next: query timers --node {node}
SELECT
    6 AS place,
    s.node, s.callback, u.function, s.path, s.topic_name,
    s.harm_ns, s.p95_ns, s.period_ns,
    s.input_ns AS usual_ns,
    s.is_supposed,
    [s.node || s.callback || coalesce(s.topic_name, '')] AS claims
FROM (
    SELECT
        b.node,
        b.what AS callback,
        b.path,
        NULL::VARCHAR AS topic_name,
        (b.total_ns / a.reached)::BIGINT AS harm_ns,
        b.p95_ns,
        t.period_ns,
        a.period_ns AS input_ns,
        false AS is_supposed
    FROM breakdown AS b
    JOIN application_path AS a ON b.path = a.path
    JOIN callback_use AS t ON b.node = t.node AND b.what = t.callback
    WHERE b.part = 'cache' AND starts_with(b.what, 'Timer(') AND t.period_ns >= 2 * a.period_ns
    UNION ALL
    SELECT
        n.full_name,
        printf('Timer(%.10g ms)', t.period_ns / 1e6),
        a.path, e.topic_name,
        t.period_ns // 2,
        t.period_ns, t.period_ns, c.period_ns, true
    FROM open_end AS e
    JOIN main.node AS n ON e.node_id = n.node_id
    JOIN main.timer AS t ON e.timer_id = t.timer_id
    JOIN callback_use AS c
        ON n.full_name = c.node
        AND starts_with(c.callback, printf('Subscription(%s)', e.topic_name))
    JOIN application_path AS a
        ON ends_with(a.path, printf(' → %s → %s', e.topic_name, n.full_name))
    WHERE t.period_ns >= 2 * c.period_ns
) AS s
CROSS JOIN noticed AS l
LEFT JOIN callback_use AS u ON s.node = u.node AND s.callback = u.callback
WHERE s.p95_ns >= l.late_ns
