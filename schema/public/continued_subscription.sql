-- description: Subscriptions at which flows go on: at least one of their messages led to another
--     message.
-- grain: one row per such subscription
-- param: runs
-- column: subscription_id
CREATE OR REPLACE MACRO main.continued_subscription(runs) AS TABLE
SELECT DISTINCT subscription_id FROM derive.continued_pair WHERE list_contains(runs, run_id)
