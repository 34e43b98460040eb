-- title: Messages to replay
-- description: Which message came to which subscription, which callback instance got it, and when
--     it came, as far as the trace tells. One that a full queue dropped came, too. What calls
--     the callback of a service or client comes to the negative number of that.
-- grain: one row per publication and subscription that it came to
-- param: begin_ns BIGINT  What begins earlier is left out
-- param: until_ns BIGINT  What begins later is left out
WITH message AS (
    SELECT
        d.publication_id, d.subscription_id, i.callback_instance_id,
        CASE WHEN a.is_exact THEN a.arrived_ns END AS arrived_ns,
        b.start_ns
    FROM main.stat_delivery AS d
    JOIN main.publication AS b ON d.publication_id = b.publication_id
    LEFT JOIN main.callback_instance AS i ON d.take_id = i.take_id
    LEFT JOIN main.arrival AS a ON d.take_id = a.take_id
    WHERE d.run_id = $run_id AND (d.take_id IS NOT NULL OR d.reason = 'overwritten')
    UNION ALL
    SELECT
        coalesce(-2 * i.request_id, -2 * i.response_id - 1),
        -i.callback_id AS subscription_id,
        i.callback_instance_id, NULL, i.start_ns
    FROM main.callback_instance AS i
    WHERE i.run_id = $run_id AND coalesce(i.request_id, i.response_id) IS NOT NULL
)
SELECT publication_id, subscription_id, callback_instance_id, arrived_ns
FROM message
WHERE start_ns BETWEEN $begin_ns AND $until_ns
ORDER BY publication_id, subscription_id
