-- description: Subscriptions at which flows go on: at least one of their messages led to another
--     message.
-- grain: one row per such subscription
-- param: runs BIGINT[]  Runs to look at
-- column: subscription_id BIGINT  The subscription
CREATE OR REPLACE MACRO main.continued_subscription(runs) AS TABLE
SELECT DISTINCT subscription_id FROM derive.continued_pair WHERE list_contains(runs, run_id)
