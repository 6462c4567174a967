#pragma once

void runReceiverTests();
void runRadioLinkTests();
