-- description: The run, if a search for all its paths (main.flow_path) may have to stop at the
--     limits. Chains are only counted, by the subscription that they lead to, so that this costs
--     little. One that comes to a subscription twice counts, too: there may be fewer.
-- grain: one row, if there may be more chains than the limits allow
-- param: max_depth INTEGER = 32  Longest chain, in topics
-- param: max_paths INTEGER = 1000  Most chains
CREATE OR REPLACE MACRO derive.many_chains(only_run, max_depth := 32, max_paths := 1000) AS TABLE
WITH RECURSIVE hop AS (
    SELECT from_subscription_id, subscription_id, is_source
    FROM store.flow_hop
    WHERE run_id = only_run
),
reached AS (
    SELECT
        subscription_id, 1 AS depth,
        count(*)::DOUBLE AS number
    FROM hop
    WHERE from_subscription_id IS NULL AND is_source
    GROUP BY subscription_id
    UNION ALL
    SELECT
        h.subscription_id,
        r.depth + 1,
        sum(r.number)
    FROM reached AS r
    JOIN hop AS h ON r.subscription_id = h.from_subscription_id
    WHERE r.depth <= max_depth
    GROUP BY h.subscription_id, r.depth
)
SELECT only_run AS run_id
FROM (
    SELECT
        max(depth) AS deepest,
        sum(number) AS chains
    FROM reached
)
WHERE deepest > max_depth OR chains > max_paths
